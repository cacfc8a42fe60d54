// Drawing of a captured frame, in which only passes with changed inputs run.

import { GpuScene } from "./device.js";
import { Dependencies, Hash } from "./graph.js";

/** @typedef {import("./device.js").Scene} Scene */
/** @typedef {import("./device.js").Frame} Frame */
/** @typedef {import("./device.js").Pass} Pass */

const ALIGNMENT = 256; // alignment of records in a buffer

/** Uniform records of a frame in one buffer. */
export class Records {
    /** @param {GpuScene} gpuScene @param {Frame} frame */
    constructor(gpuScene, frame) {
        this.gpuScene = gpuScene;
        this.frame = frame;
        let end = 0;
        /** @type {number[]} */
        this.starts = frame.records.map(([struct]) => {
            const start = end;
            end += Math.ceil(gpuScene.scene.structs[struct].size / ALIGNMENT) * ALIGNMENT;
            return start;
        });
        this.bytes = new ArrayBuffer(Math.max(end, ALIGNMENT));
        this.buffer = gpuScene.device.createBuffer({ size: this.bytes.byteLength, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
        frame.records.forEach(([, blob], k) => new Uint8Array(this.bytes, this.starts[k]).set(gpuScene.bytes(blob)));
        this.initialBytes = this.bytes.slice(0);
    }

    /** Restore the captured records. */
    reset() {
        new Uint8Array(this.bytes).set(new Uint8Array(this.initialBytes));
    }

    /** Return the number of the record of a struct, or -1. @param {string} struct */
    find(struct) {
        return this.frame.records.findIndex(([name]) => name === struct);
    }

    /**
     * Write values to a member of record k.
     * @param {number} k @param {string} name @param {number[]} values @param {number} start offset in the member [words]
     */
    put(k, name, values, start = 0) {
        const [offset] = this.gpuScene.scene.structs[this.frame.records[k][0]].members[name];
        this.floats(k).set(values, offset + start);
    }

    /** Return the floats of record k. @param {number} k */
    floats(k) {
        return new Float32Array(this.bytes, this.starts[k], this.size(k) / 4);
    }

    /** @param {number} k */
    size(k) {
        return this.gpuScene.scene.structs[this.frame.records[k][0]].size;
    }

    /** Return a hash of record k. @param {number} k */
    version(k) {
        const hash = new Hash();
        for (const word of new Int32Array(this.bytes, this.starts[k], this.size(k) / 4)) hash.add(word);
        return hash.value();
    }
}

/** Player of one frame. */
export class Player {
    /** @param {GpuScene} gpuScene @param {Frame} frame */
    constructor(gpuScene, frame) {
        this.gpuScene = gpuScene;
        this.frame = frame;
        this.records = new Records(gpuScene, frame);
        /** @type {Uint8Array[]} data that the host writes, by pass */
        this.written = frame.passes.map((one) => (one.written ? gpuScene.bytes(one.written[1]).slice() : new Uint8Array(0)));
        this.initialWritten = this.written.map((bytes) => bytes.slice());
        this.rasterises = frame.passes.some((one) => one.raster);
        /** @type {number[]} hash of the data of each pass */
        this.writtenHashes = this.written.map(hashBytes);
        /** @type {number[][]} groups of passes that run together */
        this.units = passUnits(frame.passes);
        this.dependencies = new Dependencies(this.units.map((unit) => mergeAccesses(unit.map((k) => this.#access(frame.passes[k])))));
        this.keys = frame.passes.map(passKey);
        /** @type {any[]} compiled pipelines, by pass */
        this.pipelines = [];
        /** @type {(GPUBindGroup | null)[]} */
        this.groups = [];
        /** @type {string[]} stages of the last frame's passes */
        this.ran = [];
    }

    /** Create all resources while pipelines compile. */
    prepare() {
        this.gpuScene.compile(this.frame);
        this.groups = this.frame.passes.map((one) => (one.written ? null : this.gpuScene.group(one, (k) => this.#record(k))));
    }

    /** Run the passes with changed inputs, each once it is compiled; return an encoder with those not yet submitted. */
    async draw() {
        const { device } = this.gpuScene;
        let encoder = device.createCommandEncoder();
        const versions = this.#versions();
        const dueUnits = this.dependencies.due(versions);
        /** @type {boolean[]} */
        const due = [];
        this.units.forEach((unit, index) => unit.forEach((k) => (due[k] = dueUnits[index])));
        device.queue.writeBuffer(this.records.buffer, 0, this.records.bytes);
        /** @type {GPUComputePassEncoder | null} */
        let open = null;
        for (const [index, one] of this.frame.passes.entries()) {
            if (!due[index]) continue;
            if (!one.written && !this.pipelines[index]) {
                open?.end();
                open = null;
                device.queue.submit([encoder.finish()]);
                this.pipelines[index] = await this.gpuScene.pipeline(one.program);
                encoder = device.createCommandEncoder();
            }
            if (one.written) {
                device.queue.writeBuffer(this.gpuScene.resource(one.written[0]), 0, /** @type {any} */ (this.written[index]));
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
        this.dependencies.ran(dueUnits, versions);
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
                if (one.written) hash.addLarge(this.writtenHashes[index]);
            }
            return hash.value();
        });
        return this.dependencies.versions(keys);
    }

    /** @param {GPUCommandEncoder} encoder @param {Pass} one @param {number} index */
    rasterise(encoder, one, index) {
        const { layer, far, indices, depth, target } = /** @type {NonNullable<Pass["raster"]>} */ (one.raster);
        const pass = encoder.beginRenderPass({
            colorAttachments: target < 0 ? [] : [{ view: this.gpuScene.resource(target), loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 0] }],
            depthStencilAttachment: { view: this.gpuScene.resource(depth), depthLoadOp: "clear", depthStoreOp: "store", depthClearValue: far },
        });
        pass.setPipeline(this.pipelines[index]);
        pass.setBindGroup(0, this.groups[index]);
        if (indices >= 0) {
            pass.setIndexBuffer(this.gpuScene.resource(indices), "uint32");
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
        const slot = (/** @type {number} */ k) => this.gpuScene.slot(k);
        if (one.written) return { reads: [], writes: [slot(one.written[0])] };
        const { bindings } = this.gpuScene.scene.programs[one.program];
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

/** Return a hash of a pass without the contents of its records. @param {Pass} one */
function passKey(one) {
    const hash = new Hash();
    for (const k of [one.program, ...one.bound, ...one.groups]) hash.add(k);
    if (one.raster) for (const k of Object.values(one.raster)) hash.add(k);
    return hash.value();
}

/** @param {Uint8Array} bytes */
export function hashBytes(bytes) {
    const hash = new Hash();
    for (const word of new Int32Array(bytes.slice().buffer, 0, bytes.length >> 2)) hash.add(word);
    return hash.value();
}

/** Return the numbers of the passes of each unit. @param {Pass[]} passes */
function passUnits(passes) {
    /** @type {number[][]} */
    const units = [];
    passes.forEach((one, k) => (k && one.unit === passes[k - 1].unit ? units[units.length - 1].push(k) : units.push([k])));
    return units;
}

/**
 * Return the slots that a unit of passes reads and writes, without scratch resources.
 * @param {import("./graph.js").Access[]} accesses
 */
function mergeAccesses(accesses) {
    if (accesses.length === 1) return accesses[0];
    const reads = new Set();
    const writes = new Set();
    for (const one of accesses) {
        for (const slot of one.reads) if (!writes.has(slot) && !one.writes.includes(slot)) reads.add(slot);
        for (const slot of one.writes) writes.add(slot);
    }
    return { reads: [...reads], writes: [...writes].filter((slot) => !slot.scratch) };
}
