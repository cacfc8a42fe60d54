// Sliders move the edge between two pictures; a click on a panel shows it large.
for (const range of document.querySelectorAll(".slider input")) {
  const place = () => range.parentElement.style.setProperty("--at", range.value + "%");
  range.addEventListener("input", place);
  place();
}
const large = document.body.appendChild(document.createElement("dialog"));
large.addEventListener("click", () => large.close());
large.addEventListener("keydown", () => large.close());
for (const image of document.querySelectorAll(".panels img")) {
  const open = (event) => {
    event.preventDefault();
    const copy = document.createElement("img");
    [copy.src, copy.alt] = [image.src, image.alt];
    large.setAttribute("aria-label", image.alt);
    large.replaceChildren(copy);
    large.showModal();
  };
  image.tabIndex = 0;
  image.setAttribute("role", "button");
  image.setAttribute("aria-label", image.alt + ", large");
  image.addEventListener("click", open);
  image.addEventListener("keydown", (event) => (event.key === "Enter" || event.key === " ") && open(event));
}
