// What the file holds: one gzip of numbers as differences, byte plane by byte plane.

/**
 * A run of bytes: where it begins, how many there are, the bytes of a word, words of a row, and how often
 * differences from row to row were taken.
 * @typedef {[number, number, number, number, number]} Run
 */

/** @param {string} text base64 */
export function bytesOf(text) {
    const native = /** @type {any} */ (Uint8Array).fromBase64;
    if (native) return /** @type {Uint8Array} */ (native.call(Uint8Array, text));
    const raw = atob(text);
    const found = new Uint8Array(raw.length);
    for (let k = 0; k < raw.length; k++) found[k] = raw.charCodeAt(k);
    return found;
}

/** @param {Uint8Array} bytes @returns {Promise<Uint8Array>} */
export async function inflated(bytes) {
    const stream = new Blob([/** @type {any} */ (bytes)]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** @param {Uint8Array} data @param {Run} run */
export function unpacked(data, [start, size, word, row, order]) {
    const planes = data.subarray(start, start + size);
    if (word === 1 && order === 0) return planes;
    const count = size / word;
    const words = word === 4 ? new Uint32Array(count) : word === 2 ? new Uint16Array(count) : new Uint8Array(count);
    for (let plane = 0; plane < word; plane++) {
        const shift = 8 * plane;
        const from = plane * count;
        for (let k = 0; k < count; k++) words[k] |= planes[from + k] << shift;
    }
    for (let time = 0; time < order; time++) {
        for (let k = row; k < count; k++) words[k] += words[k - row];
    }
    return new Uint8Array(words.buffer);
}
