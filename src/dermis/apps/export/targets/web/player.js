// Plays the frames of a file: only stale passes run.

import { Made } from "./device.js";
import { Dependencies, Hash } from "./graph.js";

/** @typedef {import("./device.js").Scene} Scene */
/** @typedef {import("./device.js").Frame} Frame */
/** @typedef {import("./device.js").Pass} Pass */

const STEP = 256; // alignment of records in a buffer

/** The records of a frame: their numbers, where they lie, and a version of each. */
export class Records {
    /** @param {Made} made @param {Frame} frame */
    constructor(made, frame) {
        this.made = made;
        this.frame = frame;
        let end = 0;
        /** @type {number[]} */
        this.starts = frame.records.map(([struct]) => {
            const start = end;
            end += Math.ceil(made.scene.structs[struct].size / STEP) * STEP;
            return start;
        });
        this.bytes = new ArrayBuffer(Math.max(end, STEP));
        this.buffer = made.device.createBuffer({ size: this.bytes.byteLength, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
        frame.records.forEach(([, blob], k) => new Uint8Array(this.bytes, this.starts[k]).set(made.bytes(blob)));
        this.taken = this.bytes.slice(0);
    }

    /** Take all as they were taken down. */
    reset() {
        new Uint8Array(this.bytes).set(new Uint8Array(this.taken));
    }

    /** The number of the record of a structure, -1 for none. @param {string} struct */
    find(struct) {
        return this.frame.records.findIndex(([name]) => name === struct);
    }

    /**
     * Put numbers into a member of record k.
     * @param {number} k @param {string} name @param {number[]} values @param {number} start of them in the member
     */
    put(k, name, values, start = 0) {
        const [offset] = this.made.scene.structs[this.frame.records[k][0]].members[name];
        this.floats(k).set(values, offset + start);
    }

    /** The floats of record k. @param {number} k */
    floats(k) {
        return new Float32Array(this.bytes, this.starts[k], this.size(k) / 4);
    }

    /** @param {number} k */
    size(k) {
        return this.made.scene.structs[this.frame.records[k][0]].size;
    }

    /** A number that follows from the content of record k. @param {number} k */
    version(k) {
        const hash = new Hash();
        for (const word of new Int32Array(this.bytes, this.starts[k], this.size(k) / 4)) hash.add(word);
        return hash.value();
    }
}

/** One frame of a file, ready to be drawn again and again. */
export class Player {
    /** @param {Made} made @param {Frame} frame */
    constructor(made, frame) {
        this.made = made;
        this.frame = frame;
        this.records = new Records(made, frame);
        /** @type {Uint8Array[]} what the host writes, by pass */
        this.written = frame.passes.map((one) => (one.written ? made.bytes(one.written[1]).slice() : new Uint8Array(0)));
        this.rest = this.written.map((bytes) => bytes.slice());
        this.rasterises = frame.passes.some((one) => one.raster);
        /** @type {number[]} a number that follows from each */
        this.writing = this.written.map(numberOf);
        /** @type {number[][]} passes that run as a whole */
        this.units = unitsOf(frame.passes);
        this.dependencies = new Dependencies(this.units.map((unit) => joined(unit.map((k) => this.#access(frame.passes[k])))));
        this.keys = frame.passes.map(keyOf);
        /** @type {any[]} by pass, those that are compiled */
        this.pipelines = [];
        /** @type {(GPUBindGroup | null)[]} */
        this.groups = [];
        /** @type {string[]} stages of the last frame's passes */
        this.ran = [];
    }

    /** Fill everything; what is not compiled yet goes on beside it. */
    prepare() {
        this.made.compile(this.frame);
        this.groups = this.frame.passes.map((one) => (one.written ? null : this.made.group(one, (k) => this.#record(k))));
    }

    /** Run what is stale, each pass once it is compiled; returns an encoder with those that are not submitted yet. */
    async draw() {
        const { device } = this.made;
        let encoder = device.createCommandEncoder();
        const versions = this.#versions();
        const now = this.dependencies.due(versions);
        /** @type {boolean[]} */
        const due = [];
        this.units.forEach((unit, index) => unit.forEach((k) => (due[k] = now[index])));
        device.queue.writeBuffer(this.records.buffer, 0, this.records.bytes);
        /** @type {GPUComputePassEncoder | null} */
        let open = null;
        for (const [index, one] of this.frame.passes.entries()) {
            if (!due[index]) continue;
            if (!one.written && !this.pipelines[index]) {
                open?.end();
                open = null;
                device.queue.submit([encoder.finish()]);
                this.pipelines[index] = await this.made.pipeline(one.program);
                encoder = device.createCommandEncoder();
            }
            if (one.written) {
                device.queue.writeBuffer(this.made.resource(one.written[0]), 0, /** @type {any} */ (this.written[index]));
            } else if (one.raster) {
                open?.end();
                open = null;
                this.rasterise(encoder, one, index);
            } else {
                open ??= encoder.beginComputePass();
                open.setPipeline(this.pipelines[index]);
                open.setBindGroup(0, this.groups[index]);
                open.dispatchWorkgroups(one.groups[0], one.groups[1], one.groups[2]);
            }
        }
        open?.end();
        this.dependencies.ran(now, versions);
        this.ran = [...new Set(this.frame.passes.filter((_, k) => due[k]).map((one) => one.stage))];
        return encoder;
    }

    #versions() {
        const records = this.frame.records.map((_, k) => this.records.version(k));
        const keys = this.units.map((unit) => {
            const hash = new Hash();
            for (const index of unit) {
                const one = this.frame.passes[index];
                hash.addLarge(this.keys[index]);
                for (const k of one.bound) if (k < 0) hash.addLarge(records[-1 - k]);
                if (one.written) hash.addLarge(this.writing[index]);
            }
            return hash.value();
        });
        return this.dependencies.versions(keys);
    }

    /** @param {GPUCommandEncoder} encoder @param {Pass} one @param {number} index */
    rasterise(encoder, one, index) {
        const { layer, far, indices, depth, target } = /** @type {NonNullable<Pass["raster"]>} */ (one.raster);
        const pass = encoder.beginRenderPass({
            colorAttachments: target < 0 ? [] : [{ view: this.made.resource(target), loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 0] }],
            depthStencilAttachment: { view: this.made.resource(depth), depthLoadOp: "clear", depthStoreOp: "store", depthClearValue: far },
        });
        pass.setPipeline(this.pipelines[index]);
        pass.setBindGroup(0, this.groups[index]);
        if (indices >= 0) {
            pass.setIndexBuffer(this.made.resource(indices), "uint32");
            pass.drawIndexed(one.groups[0], 1, 0, 0, layer);
        } else {
            pass.draw(one.groups[0], 1, 0, layer);
        }
        pass.end();
    }

    /** @param {number} k */
    #record(k) {
        return { buffer: this.records.buffer, offset: this.records.starts[k], size: this.records.size(k) };
    }

    /** @param {Pass} one */
    #access(one) {
        const slot = (/** @type {number} */ k) => this.made.slot(k);
        if (one.written) return { reads: [], writes: [slot(one.written[0])] };
        const { bindings } = this.made.scene.programs[one.program];
        const bound = bindings.map(([, , entry], k) => /** @type {[number, any]} */ ([one.bound[k], entry])).filter(([k, entry]) => k >= 0 && !entry.sampler);
        const reads = bound.filter(([, entry]) => entry.storageTexture?.access !== "write-only").map(([k]) => slot(k));
        const writes = bound.filter(([k, entry]) => k !== one.completes && (entry.storageTexture || entry.buffer?.type === "storage")).map(([k]) => slot(k));
        if (one.raster) {
            if (one.raster.indices >= 0) reads.push(slot(one.raster.indices));
            for (const k of [one.raster.depth, one.raster.target]) if (k >= 0) writes.push(slot(k));
        }
        return { reads, writes };
    }
}

/** What a pass is, its numbers aside. @param {Pass} one */
function keyOf(one) {
    const hash = new Hash();
    for (const k of [one.program, ...one.bound, ...one.groups]) hash.add(k);
    if (one.raster) for (const k of Object.values(one.raster)) hash.add(k);
    return hash.value();
}

/** @param {Uint8Array} bytes */
export function numberOf(bytes) {
    const hash = new Hash();
    for (const word of new Int32Array(bytes.slice().buffer, 0, bytes.length >> 2)) hash.add(word);
    return hash.value();
}

/** The numbers of the passes of each unit. @param {Pass[]} passes */
function unitsOf(passes) {
    /** @type {number[][]} */
    const found = [];
    passes.forEach((one, k) => (k && one.unit === passes[k - 1].unit ? found[found.length - 1].push(k) : found.push([k])));
    return found;
}

/**
 * What passes that run as a whole find written, and what they leave, scratch aside.
 * @param {import("./graph.js").Access[]} each
 */
function joined(each) {
    if (each.length === 1) return each[0];
    const reads = new Set();
    const writes = new Set();
    for (const one of each) {
        for (const slot of one.reads) if (!writes.has(slot) && !one.writes.includes(slot)) reads.add(slot);
        for (const slot of one.writes) writes.add(slot);
    }
    return { reads: [...reads], writes: [...writes].filter((slot) => !slot.scratch) };
}
