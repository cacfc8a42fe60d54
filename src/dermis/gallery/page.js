// Sliders move the edge between two pictures; a click on a panel shows it large.
for (const range of document.querySelectorAll(".slider input")) {
  const place = () => range.parentElement.style.setProperty("--at", range.value + "%");
  range.addEventListener("input", place);
  place();
}
const large = document.body.appendChild(document.createElement("dialog"));
large.addEventListener("click", () => large.close());
for (const image of document.querySelectorAll(".panels img")) {
  image.addEventListener("click", () => {
    large.replaceChildren(image.cloneNode());
    large.showModal();
  });
}
