// Decompression of the data of the file, see packing.py: 7 bits per character, gzip, byte planes and differences.

/**
 * Run of bytes: offset, size, bytes per word, words per row, order of the differences between rows, and the
 * step of each float in a row. With 0 bytes per word, the steps are numbers of runs to concatenate.
 * @typedef {[number, number, number, number, number, number[]]} Run
 */

/** Return the bytes of a text with 7 bits per character. @param {string} text */
export function decodeSevenBits(text) {
    const result = new Uint8Array((text.length * 7) >> 3);
    const code = (/** @type {number} */ k) => text.charCodeAt(k) & 127; // 0 beyond the end
    for (let [k, end] = [0, 0]; end < result.length; k += 8, end += 7) {
        for (let j = 0; j < 7; j++) result[end + j] = (code(k + j) << (j + 1)) | (code(k + j + 1) >> (6 - j));
    }
    return result;
}

/** @param {Uint8Array} bytes @returns {Promise<Uint8Array>} */
export async function gunzip(bytes) {
    const stream = new Blob([/** @type {any} */ (bytes)]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** @param {Uint8Array} data @param {Run[]} runs @param {number} number of a run @returns {Uint8Array} */
export function unpackRun(data, runs, number) {
    const [start, size, word, row, order, steps] = runs[number];
    if (!word) return concatenate(size, steps.map((one) => unpackRun(data, runs, one)));
    const columns = data.subarray(start, start + size);
    if (word * row === 1 && order === 0) return columns;
    const bytes = interleave(columns, word * row);
    const words = word === 4 ? new Uint32Array(bytes.buffer) : word === 2 ? new Uint16Array(bytes.buffer) : bytes;
    for (let pass = 0; pass < order; pass++) {
        for (let k = row; k < words.length; k++) words[k] += words[k - row];
    }
    if (!steps.length) return bytes;
    const floats = new Float32Array(words.length);
    for (let k = 0; k < words.length; k++) floats[k] = (words[k] | 0) * steps[k % row];
    return new Uint8Array(floats.buffer);
}

/** Return byte planes, stored one after the other, row by row. @param {Uint8Array} columns @param {number} width */
function interleave(columns, width) {
    const result = new Uint8Array(columns.length);
    let from = 0;
    for (let column = 0; column < width; column++) {
        for (let to = column; to < result.length; to += width) result[to] = columns[from++];
    }
    return result;
}

/** @param {number} size @param {Uint8Array[]} parts */
function concatenate(size, parts) {
    const result = new Uint8Array(size);
    let end = 0;
    for (const one of parts) {
        result.set(one, end);
        end += one.length;
    }
    return result;
}
