// Functions of all pages with a JavaScript library: settings, head, panel and messages.
const canvas = document.getElementById("picture");
const settings = JSON.parse(document.getElementById("settings").textContent);

const showMessage = (message, state) => {
  document.getElementById("told").textContent = message;
  document.documentElement.dataset.state = state;
};

const hasWebGl = () => {
  try { return document.createElement("canvas").getContext("webgl2") !== null; } catch { return false; }
};

// Return the .glb file of the head, which the page contains as gzip in base64.
const readHead = async () => {
  const packed = Uint8Array.from(atob(document.getElementById("head").textContent.trim()), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
};

const isSkin = (material) => /skin/i.test(material.name);

// Return the direction in which light travels from an azimuth and elevation [degrees].
const directionFrom = (azimuth, elevation) => {
  const [a, b] = [azimuth * Math.PI / 180, elevation * Math.PI / 180];
  return [-Math.sin(a) * Math.cos(b), -Math.sin(b), -Math.cos(a) * Math.cos(b)];
};

// Return the azimuth and elevation [degrees] from which light travels in a direction.
const anglesOf = ([x, y, z]) => [
  Math.atan2(-x, -z) * 180 / Math.PI, Math.asin(-y / Math.hypot(x, y, z)) * 180 / Math.PI];

const addSlider = (text, min, max, value, change) => {
  const label = document.createElement("label"), slider = document.createElement("input");
  Object.assign(slider, {type: "range", min, max, step: (max - min) / 200});
  slider.value = value;
  slider.addEventListener("input", () => change(Number(slider.value)));
  label.append(text, slider);
  document.getElementById("panel").append(label);
};

const addSwitch = (text, value, change) => {
  const label = document.createElement("label"), box = document.createElement("input");
  Object.assign(box, {type: "checkbox", checked: value});
  box.addEventListener("change", () => change(box.checked));
  label.append(box, ` ${text}`);
  document.getElementById("panel").append(label);
};

// Add the sliders of all pages and show the panel.
// light: {direction: [x, y, z], scaleIntensity(factor), setDirection([x, y, z])}; skin: {scaleRoughness(factor)}
const addCommonSliders = (light, skin) => {
  let [azimuth, elevation] = anglesOf(light.direction);
  const update = () => light.setDirection(directionFrom(azimuth, elevation));
  addSlider("light azimuth", -180, 180, azimuth, (x) => { azimuth = x; update(); });
  addSlider("light elevation", -85, 85, elevation, (x) => { elevation = x; update(); });
  addSlider("light intensity", 0, 2, 1, light.scaleIntensity);
  addSlider("roughness", 0.3, 2, 1, skin.scaleRoughness);
  document.getElementById("panel").hidden = false;
};

const start = async (draw) => {
  if (!hasWebGl()) {
    showMessage("This page needs WebGL 2: enable hardware acceleration, or use another browser.", "refused");
    return;
  }
  try {
    await draw();
    showMessage("", "drawn");
  } catch (error) {
    console.error(error);
    showMessage(`The head could not be drawn: ${error.message ?? error}`, "refused");
  }
};
