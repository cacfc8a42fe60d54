// Detect faces and their expressions with the networks of @vladmandic/face-api.
//
// node face_expressions.mjs NODE_MODULES < pictures.json
//
// pictures.json: a list of {"path", "width", "height"}; each file contains 8-bit RGB. Prints a list with an entry
// for each picture: {"score", "expressions"} of the face with the highest score, or null if no face is found.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";

const SMALLEST_SCORE = 0.2;
const folder = resolve(process.argv[2]);
const load = createRequire(folder + "/");
const tf = load("@tensorflow/tfjs");
load("@tensorflow/tfjs-backend-wasm").setWasmPaths(folder + "/@tensorflow/tfjs-backend-wasm/dist/");
const faceapi = load("@vladmandic/face-api/dist/face-api.node-wasm.js");
await tf.setBackend("wasm");
await tf.ready();
const models = folder + "/@vladmandic/face-api/model";
await faceapi.nets.ssdMobilenetv1.loadFromDisk(models);
await faceapi.nets.faceExpressionNet.loadFromDisk(models);
const options = new faceapi.SsdMobilenetv1Options({ minConfidence: SMALLEST_SCORE, maxResults: 1 });
const results = [];
for (const { path, width, height } of JSON.parse(readFileSync(0, "utf8"))) {
    const picture = tf.tensor3d(new Int32Array(readFileSync(path)), [height, width, 3], "int32");
    const found = await faceapi.detectSingleFace(picture, options).withFaceExpressions();
    results.push(found ? { score: found.detection.score, expressions: found.expressions } : null);
    picture.dispose();
}
process.stdout.write(JSON.stringify(results));
