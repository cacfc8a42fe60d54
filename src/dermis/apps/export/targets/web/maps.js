// Maps stored as pictures: decoding to half floats, and computation of the other mip levels on the device.

/** @typedef {import("./device.js").GpuScene} GpuScene */
/** @typedef {import("./device.js").Layer} Layer */
/** 8-bit levels of the channels of a layer, and the value of each level. @typedef {{levels: Uint8Array[], curves: Uint16Array[]}} DecodedLayer */

/**
 * Decode the picture of a layer.
 * @param {GpuScene} gpuScene @param {Layer} layer @param {number} width @param {number} height
 * @returns {Promise<DecodedLayer>}
 */
export async function decodeLayer(gpuScene, [picture, curve, colours], width, height) {
    const file = new Blob([/** @type {any} */ (gpuScene.store.pictures[picture])], { type: "image/webp" });
    const image = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    const context = /** @type {OffscreenCanvasRenderingContext2D} */ (
        new OffscreenCanvas(image.width, image.height).getContext("2d", { willReadFrequently: true })
    );
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, image.width, image.height).data;
    const halves = new Uint16Array(gpuScene.bytes(curve).slice().buffer);
    const curves = Array.from({ length: halves.length / 256 }, (_, k) => halves.subarray(256 * k, 256 * (k + 1)));
    const count = width * height;
    const levels = curves.map((_, channel) => {
        const channelLevels = new Uint8Array(count);
        const start = colours ? channel : 4 * channel * count;
        if (!colours || channel < colours) for (let k = 0; k < count; k++) channelLevels[k] = pixels[4 * k + start];
        return channelLevels;
    });
    return { levels, curves };
}

/** Return the half-float texels of a layer. @param {DecodedLayer} decoded */
export function toTexels({ levels, curves }) {
    const channels = curves.length;
    const texels = new Uint16Array(levels[0].length * channels);
    levels.forEach((from, channel) => {
        const curve = curves[channel];
        for (let k = 0; k < from.length; k++) texels[k * channels + channel] = curve[from[k]];
    });
    return texels;
}

/** Fill all maps from their pictures. @param {GpuScene} gpuScene */
export async function fillMaps(gpuScene) {
    await Promise.all(Object.keys(gpuScene.scene.maps).map((number) => fillMap(gpuScene, Number(number))));
}

/** @param {GpuScene} gpuScene @param {number} number */
async function fillMap(gpuScene, number) {
    const { width, height } = gpuScene.resource(number);
    await Promise.all(
        gpuScene.scene.maps[number].flatMap((layers, mip) =>
            layers.map(async (layer, k) => {
                const size = [Math.max(1, width >> mip), Math.max(1, height >> mip)];
                writeTexels(gpuScene, number, toTexels(await decodeLayer(gpuScene, layer, size[0], size[1])), mip, k);
            }),
        ),
    );
    await fillMips(gpuScene, number);
}

/**
 * Write texels to a mip level of a layer.
 * @param {GpuScene} gpuScene @param {number} number @param {Uint16Array} texels @param {number} mip @param {number} layer
 */
export function writeTexels(gpuScene, number, texels, mip = 0, layer = 0) {
    const texture = gpuScene.resource(number);
    const [width, height] = [Math.max(1, texture.width >> mip), Math.max(1, texture.height >> mip)];
    const bytesPerRow = (texels.length / height) * 2;
    const to = { texture, mipLevel: mip, origin: [0, 0, layer] };
    gpuScene.device.queue.writeTexture(to, /** @type {any} */ (texels), { bytesPerRow, rowsPerImage: height }, [width, height, 1]);
}

/** Compute the other mip levels of a map from the first. @param {GpuScene} gpuScene @param {number} number */
export async function fillMips(gpuScene, number) {
    const passes = gpuScene.scene.halved[number] ?? [];
    const pipelines = await Promise.all(passes.map((one) => gpuScene.pipeline(one.program)));
    const encoder = gpuScene.device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    passes.forEach((one, k) => {
        pass.setPipeline(pipelines[k]);
        pass.setBindGroup(0, gpuScene.group(one, noRecord));
        pass.dispatchWorkgroups(one.groups[0], one.groups[1], one.groups[2]);
    });
    pass.end();
    gpuScene.device.queue.submit([encoder.finish()]);
}

/** @returns {never} */
function noRecord() {
    throw new Error("passes of mip levels use no records");
}
