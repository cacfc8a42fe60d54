// Head in three.js, which has no subsurface scattering.
const load = async () => {
  try {
    return await Promise.all([import("three"), import("three/orbit"), import("three/gltf")]);
  } catch (error) {
    throw new Error(`${settings.no_library} (${error.message})`);
  }
};

const addCamera = (THREE, OrbitControls) => {
  const {position, target, up, fov} = settings.camera;
  const camera = new THREE.PerspectiveCamera(fov * 180 / Math.PI, 1, 0.01, 100);
  camera.up.set(...up);
  camera.position.set(...position);
  const controls = new OrbitControls(camera, canvas);
  controls.target.set(...target);
  controls.update();
  Object.assign(camera, {near: 0.02 * controls.getDistance(), far: 20 * controls.getDistance()});
  return {camera, controls};
};

// center, radius : ball that encloses the head, and that the shadow map covers [m]
const addLight = (THREE, scene, {direction, irradiance}, {center, radius}) => {
  const intensity = Math.max(...irradiance, 1e-6);
  const light = new THREE.DirectionalLight(new THREE.Color(...irradiance.map((x) => x / intensity)), intensity);
  const setDirection = (vector) => {
    const offset = new THREE.Vector3(...vector).normalize().multiplyScalar(-2 * radius);
    light.position.copy(center).add(offset);
    light.target.position.copy(center);
  };
  setDirection(direction);
  light.castShadow = true;
  light.shadow.mapSize.setScalar(settings.shadow_side);
  Object.assign(light.shadow.camera, {left: -radius, right: radius, top: radius, bottom: -radius, near: 0.5 * radius, far: 4 * radius});
  Object.assign(light.shadow, {bias: -0.0005, normalBias: 0.002});
  scene.add(light, light.target);
  return {light, direction, setDirection, scaleIntensity: (x) => { light.intensity = x * intensity; }};
};

// Replace skin materials by physical ones, which have an index of refraction.
const skinMaterials = (THREE, head) => {
  const skins = new Map();
  head.traverse((one) => {
    if (!one.isMesh) { return; }
    one.castShadow = one.receiveShadow = true;
    one.frustumCulled = false;
    if (!isSkin(one.material)) { return; }
    if (!skins.has(one.material)) {
      const {ior, specularIntensity, transmission} = settings.skin;
      const {color, map, normalMap, normalScale, roughness, roughnessMap, name} = one.material;
      const common = {color, map, normalMap, normalScale, roughness, roughnessMap, name, metalness: 0};
      skins.set(one.material, new THREE.MeshPhysicalMaterial({...common, ior, specularIntensity, transmission}));
    }
    one.material = skins.get(one.material);
  });
  return [...skins.values()];
};

const drawHead = async () => {
  const [THREE, {OrbitControls}, {GLTFLoader}] = await load();
  const renderer = new THREE.WebGLRenderer({canvas, antialias: settings.smooth});
  renderer.setPixelRatio(devicePixelRatio);
  renderer.shadowMap.enabled = true;
  const scene = new THREE.Scene();
  const {camera, controls} = addCamera(THREE, OrbitControls);
  const {scene: head} = await new GLTFLoader().parseAsync((await readHead()).buffer, "");
  scene.add(head);
  const ball = new THREE.Box3().setFromObject(head).getBoundingSphere(new THREE.Sphere());
  const lights = settings.lights.map((light) => addLight(THREE, scene, light, ball));
  const skins = skinMaterials(THREE, head), roughness = skins.map((skin) => skin.roughness);
  const resize = () => {
    renderer.setSize(innerWidth, innerHeight, false);
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
  };
  resize();
  addEventListener("resize", resize);
  addCommonSliders(lights[0], {scaleRoughness: (x) => skins.forEach((skin, i) => { skin.roughness = Math.min(1, x * roughness[i]); })});
  await renderer.compileAsync(scene, camera);
  renderer.setAnimationLoop(() => { controls.update(); renderer.render(scene, camera); });
  for (let frame = 0; frame < settings.warm_frames; frame++) {
    await new Promise((resolve) => { requestAnimationFrame(resolve); });
  }
};

start(drawHead);
