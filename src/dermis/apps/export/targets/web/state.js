// State of the camera, light and sliders, and its application to the records of a frame.

import { cameraView, columnMajor, lightView, orbitCamera, rotateOffset, shiftToSample } from "./camera.js";
import { hashBytes } from "./player.js";

/** @typedef {import("./player.js").Player} Player */
/** @typedef {import("./camera.js").Interaction} Interaction */
/** @typedef {{name: string, values: number[], rest: number}} Slider */
/**
 * Rotation of the camera [rad] and factor of its distance, rotation of the first light, and values of sliders.
 * @typedef {{yaw: number, pitch: number, zoom: number, lightYaw: number, lightPitch: number, dials: Record<string, number>}} ViewState
 */

/** Return the state at which frames were captured. @param {Slider[]} dials @returns {ViewState} */
export function defaultState(dials) {
    const values = Object.fromEntries(dials.map((one) => [one.name, one.rest]));
    return { yaw: 0, pitch: 0, zoom: 1, lightYaw: 0, lightPitch: 0, dials: values };
}

/** Return the two nodes of a slider between which a value lies, with their weights. @param {Slider} slider @param {number} value */
export function nodeWeights({ values }, value) {
    let k = 0;
    while (k < values.length - 2 && value > values[k + 1]) k++;
    const weight = Math.max(0, Math.min(1, (value - values[k]) / (values[k + 1] - values[k])));
    return [[k, 1 - weight], [k + 1, weight]];
}

/** Set the records and buffers of a player to a state. @param {Player} player @param {Slider[]} dials @param {ViewState} state */
export function applyState(player, dials, state) {
    player.records.reset();
    player.written.forEach((bytes, k) => bytes.set(player.initialWritten[k]));
    for (const slider of dials) applySlider(player, slider, state.dials[slider.name]);
    player.frame.passes.forEach((one, k) => {
        if (one.written) player.writtenHashes[k] = hashBytes(player.written[k]);
    });
    const { hands } = player.gpuScene.scene;
    if (state.yaw || state.pitch || state.zoom !== 1) applyCamera(player, hands, state);
    if (state.lightYaw || state.lightPitch) applyLight(player, hands, state);
}

/** @param {Player} player @param {Slider} slider @param {number} value */
function applySlider(player, slider, value) {
    if (value === slider.rest) return;
    const nodes = player.frame.dials[slider.name] ?? [];
    for (const [node, weight] of nodeWeights(slider, value)) {
        const change = nodes[node];
        if (!change || !weight) continue;
        for (const [k, start, blob] of change.records) addScaled(player.records.floats(k), start, player.gpuScene.floats(blob), weight);
        for (const [k, start, blob] of change.written) {
            addScaled(new Float32Array(player.written[k].buffer), start, player.gpuScene.floats(blob), weight);
        }
    }
}

/** @param {Float32Array} into @param {number} start @param {Float32Array} difference @param {number} weight */
function addScaled(into, start, difference, weight) {
    for (let k = 0; k < difference.length; k++) if (difference[k]) into[start + k] += weight * difference[k];
}

/** @param {Player} player @param {Interaction} hands @param {ViewState} state */
function applyCamera(player, hands, state) {
    const view = cameraView(hands, orbitCamera(hands.camera, state.yaw, state.pitch, state.zoom));
    const { records, frame } = player;
    for (const struct of ["Shade", "StrandView"]) {
        const k = records.find(struct);
        if (k < 0) continue;
        for (const name of /** @type {const} */ (["eye", "forward", "right", "up", "shift"])) records.put(k, name, view[name]);
    }
    const samples = player.rasterises ? hands.samples : [[0.5, 0.5]];
    const clips = samples.flatMap((sample) => columnMajor(shiftToSample(view.clip, sample, frame.size)));
    records.put(frame.views.visibility, "clip", clips);
}

/** @param {Player} player @param {Interaction} hands @param {ViewState} state */
function applyLight(player, hands, state) {
    const number = hands.lights.findIndex((one) => one);
    const one = hands.lights[number];
    if (!one) return;
    const offset = one.position.map((x, k) => x - one.target[k]);
    const position = rotateOffset(offset, state.lightYaw, state.lightPitch).map((x, k) => x + one.target[k]);
    const view = lightView(hands, { ...one, position });
    if (!view) return;
    const { records, frame, gpuScene } = player;
    const k = records.find("Lights");
    const { offset: start, each, members } = gpuScene.scene.structs.Lights.members.light;
    const floats = records.floats(k);
    const words = new Int32Array(floats.buffer, floats.byteOffset, floats.length);
    const base = start + number * each;
    for (const [name, value] of Object.entries(view)) {
        const word = base + members[name][0];
        if (name === "to_map") floats.set(columnMajor(view.to_map), word);
        else if (name === "half_width") words[word] = view.half_width;
        else floats.set([value].flat(2), word);
    }
    const layer = words[base + members.layer[0]];
    records.put(frame.views.shadows, "clip", columnMajor(view.to_map), 16 * layer);
}
