// Selection of the passes of a frame that must run, by versions of the contents of resources.

/**
 * State of the content of a resource. A view is a part of its texture.
 * @typedef {{parent: Slot | null, parts: Slot[], version: number, scratch: boolean}} Slot
 */
/** @typedef {{reads: Slot[], writes: Slot[]}} Access */

/** @param {Slot | null} parent @param {boolean} scratch @returns {Slot} */
export function makeSlot(parent, scratch) {
    const slot = { parent, parts: [], version: 0, scratch };
    if (parent) parent.parts.push(slot);
    return slot;
}

/** Hash of numbers. */
export class Hash {
    constructor() {
        this.a = 0x9e3779b9;
        this.b = 0x85ebca6b;
    }

    /** @param {number} word */
    add(word) {
        this.a = Math.imul(this.a ^ word, 0x01000193) ^ (this.a >>> 15);
        this.b = Math.imul(this.b ^ (word + 0x7f4a7c15), 0xc2b2ae35) ^ (this.b >>> 13);
    }

    /** @param {number} value up to 2^53 */
    addLarge(value) {
        this.add(value | 0);
        this.add(Math.floor(value / 4294967296) | 0);
    }

    /** Return the hash; never 0, which means unknown content. */
    value() {
        return (this.a >>> 0) * 2097152 + ((this.b >>> 11) | 1);
    }
}

/** Dependencies between the passes of a frame, which run in order. */
export class Dependencies {
    /** @param {Access[]} accesses */
    constructor(accesses) {
        this.accesses = accesses;
        /** @type {[number, Slot][][]} slots that each pass reads, with the pass that wrote them, or -1 */
        this.reads = [];
        /** @type {Map<Slot, number>} last pass that writes a slot or an overlapping one */
        this.lastWriter = new Map();
        /** @type {Map<Slot, number>} */
        const writers = new Map();
        accesses.forEach((one, index) => {
            const found = one.reads.flatMap((slot) => sources(slot, writers));
            const former = found.filter((slot) => !writers.has(slot) && !one.writes.includes(slot));
            const read = found.filter((slot) => writers.has(slot) || former.includes(slot));
            this.reads.push(read.map((slot) => [writers.get(slot) ?? -1, slot]));
            for (const slot of one.writes) this.#write(slot, index, writers);
        });
    }

    /** @param {Slot} slot @param {number} index @param {Map<Slot, number>} writers */
    #write(slot, index, writers) {
        this.lastWriter.set(slot, index);
        writers.set(slot, index);
        for (const part of slot.parts) if (writers.delete(part)) this.lastWriter.set(part, index);
        if (slot.parent && writers.has(slot.parent)) this.lastWriter.set(slot.parent, index);
    }

    /**
     * Return the version of the content that each pass writes: a hash of its key and of the versions it reads.
     * @param {number[]} keys
     */
    versions(keys) {
        /** @type {number[]} */
        const computed = [];
        keys.forEach((key, index) => {
            const hash = new Hash();
            hash.addLarge(key);
            for (const [writer, slot] of this.reads[index]) {
                hash.addLarge(writer < 0 ? slot.version : computed[writer]);
            }
            computed.push(hash.value());
        });
        return computed;
    }

    /**
     * Return the mask of passes that must run so that all resources have their final contents.
     * @param {number[]} versions
     */
    due(versions) {
        const current = new Set([...this.lastWriter].filter(([slot, k]) => slot.version === versions[k]).map(([slot]) => slot));
        for (;;) {
            const due = this.#dueWith(current);
            const overwritten = new Set();
            due.forEach((now, index) => {
                if (!now) return;
                for (const slot of this.accesses[index].writes) {
                    if (!due[this.lastWriter.get(slot) ?? index] && current.has(slot)) overwritten.add(slot);
                }
            });
            if (!overwritten.size) return due;
            for (const slot of overwritten) current.delete(slot);
        }
    }

    /** @param {Set<Slot>} current */
    #dueWith(current) {
        /** @type {boolean[]} */
        const due = new Array(this.accesses.length).fill(false);
        /** @type {Map<Slot, Set<number>>} */
        const needed = new Map();
        for (let index = due.length - 1; index >= 0; index--) {
            due[index] = this.accesses[index].writes.some((slot) => {
                const isLast = this.lastWriter.get(slot) === index;
                if (isLast && current.has(slot)) return false;
                return (isLast && !slot.scratch) || needed.get(slot)?.has(index);
            });
            if (!due[index]) continue;
            for (const [writer, slot] of this.reads[index]) {
                needed.set(slot, (needed.get(slot) ?? new Set()).add(writer));
            }
        }
        return due;
    }

    /**
     * Record the versions written by the passes that ran.
     * @param {boolean[]} due
     * @param {number[]} versions
     */
    ran(due, versions) {
        due.forEach((now, index) => {
            if (now) for (const slot of this.accesses[index].writes) setVersion(slot, versions[index]);
        });
    }
}

/** @param {Slot} slot @param {Map<Slot, number>} writers */
function sources(slot, writers) {
    const found = slot.parts.filter((part) => writers.has(part));
    if (writers.has(slot)) found.push(slot);
    else if (slot.parent && writers.has(slot.parent)) found.push(slot.parent);
    return found.length ? found : [slot, ...slot.parts];
}

/** @param {Slot} slot @param {number} version */
function setVersion(slot, version) {
    slot.version = version;
    for (const part of slot.parts) part.version = version;
    if (slot.parent) slot.parent.version = 0;
}
