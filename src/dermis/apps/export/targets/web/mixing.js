// Interpolation of the colour map between nodes of sliders that change it.

import { decodeLayer, toTexels } from "./maps.js";
import { nodeWeights } from "./state.js";

/** @typedef {import("./device.js").GpuScene} GpuScene */
/** @typedef {import("./state.js").Slider} Slider */

/** Return the texels of the colour map at values of sliders. @param {GpuScene} gpuScene @param {Slider[]} changed @param {Record<string, number>} values */
export async function mixColourMap(gpuScene, changed, values) {
    const { map, dials } = gpuScene.scene.colours;
    const { width, height } = gpuScene.resource(map);
    const layer = gpuScene.scene.maps[map][0][0];
    const decode = async (/** @type {import("./device.js").Layer} */ one) => fromHalves(toTexels(await decodeLayer(gpuScene, one, width, height)));
    const base = await decode(layer);
    const sum = base.slice();
    for (const slider of changed) {
        for (const [node, weight] of nodeWeights(slider, values[slider.name])) {
            const one = dials[slider.name][node];
            if (!one || !weight) continue;
            const other = await decode(one);
            for (let k = 0; k < sum.length; k++) sum[k] += weight * (other[k] - base[k]);
        }
    }
    return toHalves(sum);
}

/** @param {Uint16Array} halves */
function fromHalves(halves) {
    const result = new Float32Array(halves.length);
    for (let k = 0; k < halves.length; k++) {
        const [sign, exponent, mantissa] = [halves[k] >> 15, (halves[k] >> 10) & 31, halves[k] & 1023];
        result[k] = (sign ? -1 : 1) * (exponent ? 2 ** (exponent - 15) * (1 + mantissa / 1024) : mantissa * 2 ** -24);
    }
    return result;
}

/** @param {Float32Array} values in [0, 65504) */
function toHalves(values) {
    const words = new Uint32Array(values.buffer);
    const result = new Uint16Array(values.length);
    for (let k = 0; k < values.length; k++) result[k] = values[k] < 6.2e-5 ? 0 : ((words[k] + 0x1000 - 0x38000000) >>> 13) & 0x7fff;
    return result;
}
