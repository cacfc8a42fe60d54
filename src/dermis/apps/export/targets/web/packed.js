// What the file holds: one gzip of numbers as differences, byte column by byte column, seven bits to a letter.

/**
 * A run of bytes: where it begins, how many there are, the bytes of a word, words of a row, how often
 * differences from row to row were taken, and of floats the step of each word of a row. Words of no bytes:
 * numbers of runs to join instead.
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

/** @param {Uint8Array} data @param {Run[]} runs @param {number} number of a run @returns {Uint8Array} */
export function unpacked(data, runs, number) {
    const [start, size, word, row, order, steps] = runs[number];
    if (!word) return inOne(size, steps.map((one) => unpacked(data, runs, one)));
    const columns = data.subarray(start, start + size);
    if (word * row === 1 && order === 0) return columns;
    const bytes = inRows(columns, word * row);
    const words = word === 4 ? new Uint32Array(bytes.buffer) : word === 2 ? new Uint16Array(bytes.buffer) : bytes;
    for (let time = 0; time < order; time++) {
        for (let k = row; k < words.length; k++) words[k] += words[k - row];
    }
    if (!steps.length) return bytes;
    const floats = new Float32Array(words.length);
    for (let k = 0; k < words.length; k++) floats[k] = (words[k] | 0) * steps[k % row];
    return new Uint8Array(floats.buffer);
}

/** Columns of bytes, one after the other, row by row. @param {Uint8Array} columns @param {number} across */
function inRows(columns, across) {
    const found = new Uint8Array(columns.length);
    let from = 0;
    for (let column = 0; column < across; column++) {
        for (let to = column; to < found.length; to += across) found[to] = columns[from++];
    }
    return found;
}

/** @param {number} size @param {Uint8Array[]} parts */
function inOne(size, parts) {
    const found = new Uint8Array(size);
    let end = 0;
    for (const one of parts) {
        found.set(one, end);
        end += one.length;
    }
    return found;
}
