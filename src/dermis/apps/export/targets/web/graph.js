// Which passes of a frame have to run: the rule of the frame graph, with versions of what each resource holds.

/**
 * What a resource holds. A view is a part of its texture, and its content is then the texture's too.
 * @typedef {{parent: Slot | null, parts: Slot[], held: number, scratch: boolean}} Slot
 */
/** @typedef {{reads: Slot[], writes: Slot[]}} Access */

/** @param {Slot | null} parent @param {boolean} scratch @returns {Slot} */
export function makeSlot(parent, scratch) {
    const slot = { parent, parts: [], held: 0, scratch };
    if (parent) parent.parts.push(slot);
    return slot;
}

/** A number from others, for which the same come only from the same, in all likelihood. */
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

    /** Never 0, which stands for unknown content. */
    value() {
        return (this.a >>> 0) * 2097152 + ((this.b >>> 11) | 1);
    }
}

/** The passes of one frame, in order, and what they read of each other. */
export class Dependencies {
    /** @param {Access[]} declared */
    constructor(declared) {
        this.declared = declared;
        /** @type {[number, Slot][][]} what each pass reads, with the pass that left it there, or -1 */
        this.reads = [];
        /** @type {Map<Slot, number>} the pass that writes a slot last, or what overlaps it */
        this.last = new Map();
        /** @type {Map<Slot, number>} */
        const writers = new Map();
        declared.forEach((one, index) => {
            const found = one.reads.flatMap((slot) => sources(slot, writers));
            const former = found.filter((slot) => !writers.has(slot) && !one.writes.includes(slot));
            const read = found.filter((slot) => writers.has(slot) || former.includes(slot));
            this.reads.push(read.map((slot) => [writers.get(slot) ?? -1, slot]));
            for (const slot of one.writes) this.#write(slot, index, writers);
        });
    }

    /** @param {Slot} slot @param {number} index @param {Map<Slot, number>} writers */
    #write(slot, index, writers) {
        this.last.set(slot, index);
        writers.set(slot, index);
        for (const part of slot.parts) if (writers.delete(part)) this.last.set(part, index);
        if (slot.parent && writers.has(slot.parent)) this.last.set(slot.parent, index);
    }

    /**
     * What each pass leaves: a number that follows from its key and the versions of what it reads.
     * @param {number[]} keys
     */
    versions(keys) {
        /** @type {number[]} */
        const made = [];
        keys.forEach((key, index) => {
            const hash = new Hash();
            hash.addLarge(key);
            for (const [writer, slot] of this.reads[index]) {
                hash.addLarge(writer < 0 ? slot.held : made[writer]);
            }
            made.push(hash.value());
        });
        return made;
    }

    /**
     * Which passes have to run for every resource to hold what all of them together leave.
     * @param {number[]} versions
     */
    due(versions) {
        const kept = new Set([...this.last].filter(([slot, k]) => slot.held === versions[k]).map(([slot]) => slot));
        for (;;) {
            const due = this.#dueWith(kept);
            const spoilt = new Set();
            due.forEach((now, index) => {
                if (!now) return;
                for (const slot of this.declared[index].writes) {
                    if (!due[this.last.get(slot) ?? index] && kept.has(slot)) spoilt.add(slot);
                }
            });
            if (!spoilt.size) return due;
            for (const slot of spoilt) kept.delete(slot);
        }
    }

    /** @param {Set<Slot>} kept */
    #dueWith(kept) {
        /** @type {boolean[]} */
        const due = new Array(this.declared.length).fill(false);
        /** @type {Map<Slot, Set<number>>} */
        const wanted = new Map();
        for (let index = due.length - 1; index >= 0; index--) {
            due[index] = this.declared[index].writes.some((slot) => {
                const last = this.last.get(slot) === index;
                if (last && kept.has(slot)) return false;
                return (last && !slot.scratch) || wanted.get(slot)?.has(index);
            });
            if (!due[index]) continue;
            for (const [writer, slot] of this.reads[index]) {
                wanted.set(slot, (wanted.get(slot) ?? new Set()).add(writer));
            }
        }
        return due;
    }

    /**
     * Note what the passes that ran have left.
     * @param {boolean[]} due
     * @param {number[]} versions
     */
    ran(due, versions) {
        due.forEach((now, index) => {
            if (now) for (const slot of this.declared[index].writes) hold(slot, versions[index]);
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
function hold(slot, version) {
    slot.held = version;
    for (const part of slot.parts) part.held = version;
    if (slot.parent) slot.parent.held = 0;
}
