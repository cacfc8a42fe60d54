// Creation of the resources, pipelines and bind groups that the page's data describes.

import { makeSlot } from "./graph.js";
import { unpackRun } from "./packed.js";

/** @typedef {import("./graph.js").Slot} Slot */
/** @typedef {import("./packed.js").Run} Run */
/**
 * @typedef {{kind: "buffer", size: number, usage: number, scratch?: boolean}
 *     | {kind: "texture", format: GPUTextureFormat, size: number[], mips: number, usage: number, scratch?: boolean}
 *     | {kind: "view", of: number, part: [number, number]}
 *     | {kind: "sampler", options: GPUSamplerDescriptor}} ResourceDescription
 */
/**
 * @typedef {{name: string, shader: number, constants: Record<string, number>,
 *     bindings: [number, string, any, number][], raster: {target: string | null, depth_compare: string} | null}} Program
 */
/**
 * @typedef {{stage: string, program: number, bound: number[], groups: number[], completes: number,
 *     raster: {layer: number, far: number, indices: number, depth: number, target: number} | null,
 *     written: [number, number] | null, unit: number}} Pass
 */
/**
 * Changes at a node of a slider: number of the record or pass, first word, and byte run of the differences.
 * @typedef {{records: number[][], written: number[][]}} Change
 */
/**
 * @typedef {{name: string, passes: Pass[], records: [string, number][], picture: number, linear: number,
 *     size: number[], moving: boolean, views: Record<string, number>, dials: Record<string, (Change | null)[]>}} Frame
 */
/** Layer of a map: number of its picture, byte run of its value curves, number of colour channels. @typedef {number[]} Layer */
/**
 * @typedef {{shaders: string[], programs: Program[], resources: ResourceDescription[],
 *     contents: Record<string, number[]>, frames: Frame[], halved: Record<string, Pass[]>,
 *     maps: Record<string, Layer[][]>, hands: import("./camera.js").Interaction,
 *     colours: {map: number, dials: Record<string, (Layer | null)[]>},
 *     structs: Record<string, {size: number, members: Record<string, any>}>}} Scene
 */
/** @typedef {{blobs: Run[], data: Uint8Array, pictures: Uint8Array[]}} Store */

/** @type {Record<string, number>} */
const TEXEL_BYTES = { r: 1, rg: 2, rgba: 4 };

/** @param {string} format such as "rgba16float" */
export function bytesPerTexel(format) {
    if (format === "depth32float") return 4;
    const [, channels, bits] = /** @type {RegExpMatchArray} */ (format.match(/^(r|rg|rgba)(8|16|32)/));
    return (TEXEL_BYTES[channels] * Number(bits)) / 8;
}

/** Resources and pipelines of a file on one device, which are created when they are first used. */
export class GpuScene {
    /** @param {GPUDevice} device @param {Scene} scene */
    constructor(device, scene) {
        this.device = device;
        this.scene = scene;
        /** @type {Store} contents of the resources, which are read after compilation has started */
        this.store = { blobs: [], data: new Uint8Array(0), pictures: [] };
        /** @type {any[]} */
        this.resources = [];
        /** @type {Map<number, Float32Array>} */
        this.changes = new Map();
        /** @type {Slot[]} */
        this.slots = [];
        /** @type {Map<number, Promise<any>>} */
        this.pipelines = new Map();
        /** @type {GPUBindGroupLayout[]} */
        this.layouts = [];
        /** @type {GPUShaderModule[]} */
        this.modules = [];
    }

    /** @param {number} blob */
    bytes(blob) {
        return unpackRun(this.store.data, this.store.blobs, blob);
    }

    /** @param {number} blob */
    floats(blob) {
        if (!this.changes.has(blob)) this.changes.set(blob, new Float32Array(this.bytes(blob).slice().buffer));
        return /** @type {Float32Array} */ (this.changes.get(blob));
    }

    /** Return a resource, which is created and filled on first use. @param {number} number @returns {any} */
    resource(number) {
        return (this.resources[number] ??= this.#create(number));
    }

    /** Return the state of the content of a resource. @param {number} number @returns {Slot} */
    slot(number) {
        const description = this.scene.resources[number];
        const parent = description.kind === "view" ? this.slot(description.of) : null;
        const scratch = parent ? parent.scratch : "scratch" in description && Boolean(description.scratch);
        return (this.slots[number] ??= makeSlot(parent, scratch));
    }

    /** @param {number} number */
    #create(number) {
        const one = this.scene.resources[number];
        if (one.kind === "sampler") return this.device.createSampler(one.options);
        if (one.kind === "buffer") return this.#buffer(number, one);
        if (one.kind === "texture") return this.#texture(number, one);
        const [layer, mip] = one.part;
        const part = { baseArrayLayer: layer, baseMipLevel: mip, arrayLayerCount: 1, mipLevelCount: 1 };
        return this.resource(one.of).createView({ dimension: "2d", ...part });
    }

    /** @param {number} number @param {{size: number, usage: number}} one */
    #buffer(number, { size, usage }) {
        const created = this.device.createBuffer({ size, usage });
        const [blob] = this.scene.contents[number] ?? [];
        if (blob !== undefined) this.device.queue.writeBuffer(created, 0, this.bytes(blob));
        return created;
    }

    /** @param {number} number @param {{format: GPUTextureFormat, size: number[], mips: number, usage: number}} one */
    #texture(number, { format, size, mips, usage }) {
        const created = this.device.createTexture({ format, size, mipLevelCount: mips, usage });
        const blobs = this.scene.contents[number] ?? [];
        blobs.forEach((blob, mip) => {
            if (blob < 0) return; // filled from a picture
            const [width, height] = size.slice(0, 2).map((side) => Math.max(1, side >> mip));
            const layout = { bytesPerRow: width * bytesPerTexel(format), rowsPerImage: height };
            const to = { texture: created, mipLevel: mip };
            this.device.queue.writeTexture(to, this.bytes(blob), layout, [width, height, size[2]]);
        });
        return created;
    }

    /** @param {number} number of a program */
    layout(number) {
        const { bindings, raster } = this.scene.programs[number];
        const visibility = raster ? GPUShaderStage.VERTEX | GPUShaderStage.FRAGMENT : GPUShaderStage.COMPUTE;
        const entries = bindings.map(([binding, , entry]) => ({ binding, visibility, ...entry }));
        return (this.layouts[number] ??= this.device.createBindGroupLayout({ entries }));
    }

    /** @param {number} number of a program @returns {Promise<any>} */
    pipeline(number) {
        if (!this.pipelines.has(number)) this.pipelines.set(number, this.#compile(number));
        return /** @type {Promise<any>} */ (this.pipelines.get(number));
    }

    /** Start to compile the pipelines of maps and of a frame, in this order. @param {Frame} frame */
    compile(frame) {
        for (const one of [...Object.values(this.scene.halved).flat(), ...frame.passes]) if (!one.written) this.pipeline(one.program).catch(() => {}); // errors are reported on use
    }

    /** @param {number} number */
    #compile(number) {
        const { name, shader, constants, raster } = this.scene.programs[number];
        const module = (this.modules[shader] ??= this.device.createShaderModule({ label: name, code: this.scene.shaders[shader] }));
        const layout = this.device.createPipelineLayout({ bindGroupLayouts: [this.layout(number)] });
        if (!raster) return this.device.createComputePipelineAsync({ label: name, layout, compute: { module, entryPoint: "main", constants } });
        const target = /** @type {GPUTextureFormat | null} */ (raster.target);
        return this.device.createRenderPipelineAsync({
            label: name,
            layout,
            vertex: { module, entryPoint: "vertex", constants },
            fragment: target ? { module, entryPoint: "fragment", targets: [{ format: target }] } : undefined,
            primitive: { topology: "triangle-list", cullMode: "none" },
            depthStencil: {
                format: "depth32float",
                depthWriteEnabled: true,
                depthCompare: /** @type {GPUCompareFunction} */ (raster.depth_compare),
            },
        });
    }

    /** Return the resource of a binding. @param {any} entry @param {number} number @returns {GPUBindingResource} */
    bindingResource(entry, number) {
        const one = this.resource(number);
        const dimension = (entry.texture ?? entry.storageTexture)?.viewDimension;
        if (this.scene.resources[number].kind === "texture") return one.createView({ dimension });
        return entry.buffer ? { buffer: one } : one;
    }

    /**
     * Return the bind group of a pass.
     * @param {Pass} one
     * @param {(k: number) => GPUBufferBinding} record returns the binding of record k of the frame
     */
    group(one, record) {
        const { bindings } = this.scene.programs[one.program];
        const entries = bindings.map(([binding, , entry], k) => ({
            binding,
            resource: one.bound[k] < 0 ? record(-1 - one.bound[k]) : this.bindingResource(entry, one.bound[k]),
        }));
        return this.device.createBindGroup({ layout: this.layout(one.program), entries });
    }
}
