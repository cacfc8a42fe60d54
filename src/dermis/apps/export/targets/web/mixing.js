// The colour map between the nodes of dials that paint it: a mean of what their pictures stand for.

import { stepsOf, texelsOf } from "./maps.js";
import { between } from "./turned.js";

/** @typedef {import("./device.js").Made} Made */
/** @typedef {import("./turned.js").Dial} Dial */

/** The colour map's texels between dials' nodes. @param {Made} made @param {Dial[]} turned @param {Record<string, number>} values */
export async function mixed(made, turned, values) {
    const { map, dials } = made.scene.colours;
    const { width, height } = made.resource(map);
    const layer = made.scene.maps[map][0][0];
    const at = async (/** @type {import("./device.js").Layer} */ one) => fromHalves(texelsOf(await stepsOf(made, one, width, height)));
    const base = await at(layer);
    const sum = base.slice();
    for (const dial of turned) {
        for (const [node, share] of between(dial, values[dial.name])) {
            const one = dials[dial.name][node];
            if (!one || !share) continue;
            const other = await at(one);
            for (let k = 0; k < sum.length; k++) sum[k] += share * (other[k] - base[k]);
        }
    }
    return toHalves(sum);
}

/** @param {Uint16Array} halves */
function fromHalves(halves) {
    const found = new Float32Array(halves.length);
    for (let k = 0; k < halves.length; k++) {
        const [sign, rank, part] = [halves[k] >> 15, (halves[k] >> 10) & 31, halves[k] & 1023];
        found[k] = (sign ? -1 : 1) * (rank ? 2 ** (rank - 15) * (1 + part / 1024) : part * 2 ** -24);
    }
    return found;
}

/** @param {Float32Array} values from 0 to some thousand, as colours are */
function toHalves(values) {
    const words = new Uint32Array(values.buffer);
    const found = new Uint16Array(values.length);
    for (let k = 0; k < values.length; k++) found[k] = values[k] < 6.2e-5 ? 0 : ((words[k] + 0x1000 - 0x38000000) >>> 13) & 0x7fff;
    return found;
}
