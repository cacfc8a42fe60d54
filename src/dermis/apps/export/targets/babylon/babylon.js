// Head in Babylon.js, with its screen-space subsurface scattering.
const colour = ([r, g, b]) => new BABYLON.Color3(r, g, b);
const vector = ([x, y, z]) => new BABYLON.Vector3(x, y, z);

const addCamera = (scene) => {
  const {position, target, up, fov} = settings.camera;
  const camera = new BABYLON.ArcRotateCamera("camera", 0, 0, 1, vector(target), scene);
  camera.upVector = vector(up);
  camera.setPosition(vector(position));
  Object.assign(camera, {fov, minZ: 0.02 * camera.radius, maxZ: 20 * camera.radius, wheelDeltaPercentage: 0.01});
  camera.lowerRadiusLimit = 0.2 * camera.radius;
  camera.attachControl(canvas, true);
};

const addLight = ({direction, irradiance}, scene) => {
  const intensity = Math.max(...irradiance, 1e-6);
  const light = new BABYLON.DirectionalLight("light", vector(direction).normalize(), scene);
  light.intensity = intensity;
  light.diffuse = light.specular = colour(irradiance.map((x) => x / intensity));
  return light;
};

const addShadow = (light, scene) => {
  const shadow = new BABYLON.ShadowGenerator(settings.shadow_side, light);
  shadow.usePercentageCloserFiltering = true;
  Object.assign(shadow, {bias: 0.002, normalBias: 0.004, transparencyShadow: false});
  for (const mesh of scene.meshes) {
    if (mesh.getTotalVertices() > 0) { shadow.addShadowCaster(mesh, false); mesh.receiveShadows = true; }
  }
};

const enableScattering = (skins, scene) => {
  const scattering = scene.enableSubSurfaceForPrePass();
  if (!scattering) { throw new Error("this device cannot render to several float textures at once"); }
  scattering.metersPerUnit = settings.skin.metersPerUnit;
  for (const skin of skins) {
    skin.subSurface.isScatteringEnabled = true;
    skin.subSurface.scatteringDiffusionProfile = colour(settings.skin.scatteringDiffusionProfile);
  }
  return scattering;
};

const addPanel = (scattering, skins, light) => {
  const roughness = skins.map((skin) => skin.roughness), {intensity} = light;
  addSwitch("scattering", true, (on) => skins.forEach((skin) => { skin.subSurface.isScatteringEnabled = on; }));
  addSlider("scattering width", 0.25, 4, 1, (x) => { scattering.metersPerUnit = settings.skin.metersPerUnit / x; });
  addCommonSliders(
    {
      direction: light.direction.asArray(),
      scaleIntensity: (x) => { light.intensity = x * intensity; },
      setDirection: (direction) => { light.direction = vector(direction); },
    },
    {scaleRoughness: (x) => skins.forEach((skin, i) => { skin.roughness = Math.min(1, x * roughness[i]); })},
  );
};

const drawHead = async () => {
  if (typeof BABYLON === "undefined") { throw new Error(settings.no_library); }
  const engine = new BABYLON.Engine(canvas, false, {useHighPrecisionFloats: true}, true);
  BABYLON.SceneLoaderFlags.ShowLoadingScreen = false;
  const scene = new BABYLON.Scene(engine);
  Object.assign(scene, {useRightHandedSystem: true, clearColor: new BABYLON.Color4(0, 0, 0, 1)});
  addCamera(scene);
  await BABYLON.ImportMeshAsync(await readHead(), scene, {pluginExtension: ".glb"});
  const lights = settings.lights.map((light) => addLight(light, scene));
  lights.forEach((light) => addShadow(light, scene));
  scene.materials.forEach((material) => { material.maxSimultaneousLights = lights.length; });
  const skins = scene.materials.filter(isSkin);
  const scattering = enableScattering(skins, scene);
  if (settings.smooth) { new BABYLON.FxaaPostProcess("smooth", 1, scene.activeCamera); }
  await scene.whenReadyAsync();
  addPanel(scattering, skins, lights[0]);
  engine.runRenderLoop(() => scene.render());
  addEventListener("resize", () => engine.resize());
  for (let frame = 0; frame < settings.warm_frames; frame++) {
    await new Promise((resolve) => { scene.onAfterRenderObservable.addOnce(resolve); });
  }
};

start(drawHead);
