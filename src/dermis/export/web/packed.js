// What the file holds: one gzip of numbers as differences, byte plane by byte plane, seven bits to a letter.

/**
 * A run of bytes: where it begins, how many there are, the bytes of a word, words of a row, how often
 * differences from row to row were taken, and of floats the step of each word of a row.
 * @typedef {[number, number, number, number, number, number[]]} Run
 */

/** Bytes of a text with seven bits in each letter, 256 more where it could not stand in a page. @param {string} text */
export function bytesOf(text) {
    const found = new Uint8Array((text.length * 7) >> 3);
    const letter = (/** @type {number} */ k) => text.charCodeAt(k) & 127; // 0 beyond the end
    for (let [k, end] = [0, 0]; end < found.length; k += 8, end += 7) {
        for (let j = 0; j < 7; j++) found[end + j] = (letter(k + j) << (j + 1)) | (letter(k + j + 1) >> (6 - j));
    }
    return found;
}

/** @param {Uint8Array} bytes @returns {Promise<Uint8Array>} */
export async function inflated(bytes) {
    const stream = new Blob([/** @type {any} */ (bytes)]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** @param {Uint8Array} data @param {Run} run */
export function unpacked(data, [start, size, word, row, order, steps]) {
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
    if (!steps.length) return new Uint8Array(words.buffer);
    const floats = new Float32Array(count);
    for (let k = 0; k < count; k++) floats[k] = (words[k] | 0) * steps[k % row];
    return new Uint8Array(floats.buffer);
}
