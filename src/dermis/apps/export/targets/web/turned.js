// What hands have turned, put into a frame's numbers.

import { cameraView, columns, lightView, orbited, sampled, turned } from "./camera.js";
import { numberOf } from "./player.js";

/** @typedef {import("./player.js").Player} Player */
/** @typedef {import("./camera.js").Hands} Hands */
/** @typedef {{name: string, values: number[], rest: number}} Dial */
/**
 * The camera turned by yaw and pitch [rad] and moved by a factor; the first light turned likewise; dials' values.
 * @typedef {{yaw: number, pitch: number, zoom: number, lightYaw: number, lightPitch: number, dials: Record<string, number>}} Turned
 */

/** As the frame was taken down. @param {Dial[]} dials @returns {Turned} */
export function atRest(dials) {
    const values = Object.fromEntries(dials.map((one) => [one.name, one.rest]));
    return { yaw: 0, pitch: 0, zoom: 1, lightYaw: 0, lightPitch: 0, dials: values };
}

/** Where a value lies between a dial's nodes: shares of two of them. @param {Dial} dial @param {number} value */
export function between({ values }, value) {
    let k = 0;
    while (k < values.length - 2 && value > values[k + 1]) k++;
    const share = Math.max(0, Math.min(1, (value - values[k]) / (values[k + 1] - values[k])));
    return [[k, 1 - share], [k + 1, share]];
}

/** Bring a player's numbers to where the hands have them. @param {Player} player @param {Dial[]} dials @param {Turned} state */
export function apply(player, dials, state) {
    player.records.reset();
    player.written.forEach((bytes, k) => bytes.set(player.rest[k]));
    for (const dial of dials) turnDial(player, dial, state.dials[dial.name]);
    player.frame.passes.forEach((one, k) => {
        if (one.written) player.writing[k] = numberOf(player.written[k]);
    });
    const { hands } = player.made.scene;
    if (state.yaw || state.pitch || state.zoom !== 1) look(player, hands, state);
    if (state.lightYaw || state.lightPitch) light(player, hands, state);
}

/** @param {Player} player @param {Dial} dial @param {number} value */
function turnDial(player, dial, value) {
    if (value === dial.rest) return;
    const nodes = player.frame.dials[dial.name] ?? [];
    for (const [node, share] of between(dial, value)) {
        const change = nodes[node];
        if (!change || !share) continue;
        for (const [k, start, blob] of change.records) mix(player.records.floats(k), start, player.made.floats(blob), share);
        for (const [k, start, blob] of change.written) {
            mix(new Float32Array(player.written[k].buffer), start, player.made.floats(blob), share);
        }
    }
}

/** @param {Float32Array} into @param {number} start @param {Float32Array} difference @param {number} share */
function mix(into, start, difference, share) {
    for (let k = 0; k < difference.length; k++) if (difference[k]) into[start + k] += share * difference[k];
}

/** @param {Player} player @param {Hands} hands @param {Turned} state */
function look(player, hands, state) {
    const view = cameraView(hands, orbited(hands.camera, state.yaw, state.pitch, state.zoom));
    const { records, frame } = player;
    for (const struct of ["Shade", "StrandView"]) {
        const k = records.find(struct);
        if (k < 0) continue;
        for (const name of /** @type {const} */ (["eye", "forward", "right", "up", "shift"])) records.put(k, name, view[name]);
    }
    const places = player.rasterises ? hands.samples : [[0.5, 0.5]];
    const clips = places.flatMap((place) => columns(sampled(view.clip, place, frame.size)));
    records.put(frame.views.visibility, "clip", clips);
}

/** @param {Player} player @param {Hands} hands @param {Turned} state */
function light(player, hands, state) {
    const number = hands.lights.findIndex((one) => one);
    const one = hands.lights[number];
    if (!one) return;
    const offset = one.position.map((x, k) => x - one.target[k]);
    const position = turned(offset, state.lightYaw, state.lightPitch).map((x, k) => x + one.target[k]);
    const view = lightView(hands, { ...one, position });
    if (!view) return;
    const { records, frame, made } = player;
    const k = records.find("Lights");
    const { offset: start, each, members } = made.scene.structs.Lights.members.light;
    const floats = records.floats(k);
    const words = new Int32Array(floats.buffer, floats.byteOffset, floats.length);
    const base = start + number * each;
    for (const [name, value] of Object.entries(view)) {
        const at = base + members[name][0];
        if (name === "to_map") floats.set(columns(view.to_map), at);
        else if (name === "half_width") words[at] = view.half_width;
        else floats.set([value].flat(2), at);
    }
    const layer = words[base + members.layer[0]];
    records.put(frame.views.shadows, "clip", columns(view.to_map), 16 * layer);
}
