// What both pages have: the settings, the head's bytes, the panel and messages.
const canvas = document.getElementById("picture");
const settings = JSON.parse(document.getElementById("settings").textContent);

const tell = (words, state) => {
  document.getElementById("told").textContent = words;
  document.documentElement.dataset.state = state;
};

const hasWebGl = () => {
  try { return document.createElement("canvas").getContext("webgl2") !== null; } catch { return false; }
};

const readHead = () => Uint8Array.from(atob(document.getElementById("head").textContent.trim()), (c) => c.charCodeAt(0));

const isSkin = (material) => /skin/i.test(material.name);

// The first light from another side [degrees around and upwards]: the way in which it travels.
const turnedDirection = (around, up) => {
  const [a, b] = [around * Math.PI / 180, up * Math.PI / 180];
  return [-Math.sin(a) * Math.cos(b), -Math.sin(b), -Math.cos(a) * Math.cos(b)];
};

const sideOf = ([x, y, z]) => [
  Math.atan2(-x, -z) * 180 / Math.PI, Math.asin(-y / Math.hypot(x, y, z)) * 180 / Math.PI];

const addSlider = (words, least, most, value, change) => {
  const label = document.createElement("label"), slider = document.createElement("input");
  Object.assign(slider, {type: "range", min: least, max: most, step: (most - least) / 200});
  slider.value = value;
  slider.addEventListener("input", () => change(Number(slider.value)));
  label.append(words, slider);
  document.getElementById("panel").append(label);
};

const addSwitch = (words, value, change) => {
  const label = document.createElement("label"), box = document.createElement("input");
  Object.assign(box, {type: "checkbox", checked: value});
  box.addEventListener("change", () => change(box.checked));
  label.append(box, ` ${words}`);
  document.getElementById("panel").append(label);
};

// light: {direction: [x, y, z], brighten(factor), turn([x, y, z])}; skin: {roughen(factor)}
const addUsual = (light, skin) => {
  let [around, up] = sideOf(light.direction);
  const turn = () => light.turn(turnedDirection(around, up));
  addSlider("light from the side", -180, 180, around, (x) => { around = x; turn(); });
  addSlider("light from above", -85, 85, up, (x) => { up = x; turn(); });
  addSlider("brightness", 0, 2, 1, light.brighten);
  addSlider("roughness", 0.3, 2, 1, skin.roughen);
  document.getElementById("panel").hidden = false;
};

const start = async (draw) => {
  if (!hasWebGl()) {
    tell("This browser has no WebGL 2, which draws the head: turn on hardware acceleration, or use another one.", "refused");
    return;
  }
  try {
    await draw();
    tell("", "drawn");
  } catch (fault) {
    console.error(fault);
    tell(`The head could not be drawn: ${fault.message ?? fault}`, "refused");
  }
};
