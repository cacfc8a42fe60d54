// Maps that come as pictures: decoded, turned into halves, and halved by the device where it can.

/** @typedef {import("./device.js").Made} Made */
/** @typedef {import("./device.js").Layer} Layer */
/** Steps of a picture's channels, one after the other, with what they stand for. @typedef {{steps: Uint8Array[], curves: Uint16Array[]}} Steps */

/**
 * A layer's steps, decoded once.
 * @param {Made} made @param {Layer} layer @param {number} width @param {number} height
 * @returns {Promise<Steps>}
 */
export async function stepsOf(made, [picture, curve, colours], width, height) {
    const file = new Blob([/** @type {any} */ (made.store.pictures[picture])], { type: "image/webp" });
    const image = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
    const context = /** @type {OffscreenCanvasRenderingContext2D} */ (
        new OffscreenCanvas(image.width, image.height).getContext("2d", { willReadFrequently: true })
    );
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, image.width, image.height).data;
    const halves = new Uint16Array(made.bytes(curve).slice().buffer);
    const curves = Array.from({ length: halves.length / 256 }, (_, k) => halves.subarray(256 * k, 256 * (k + 1)));
    const count = width * height;
    const steps = curves.map((_, channel) => {
        const found = new Uint8Array(count);
        const start = colours ? channel : 4 * channel * count;
        if (!colours || channel < colours) for (let k = 0; k < count; k++) found[k] = pixels[4 * k + start];
        return found;
    });
    return { steps, curves };
}

/** The texels that steps stand for. @param {Steps} decoded */
export function texelsOf({ steps, curves }) {
    const channels = curves.length;
    const texels = new Uint16Array(steps[0].length * channels);
    steps.forEach((from, channel) => {
        const curve = curves[channel];
        for (let k = 0; k < from.length; k++) texels[k * channels + channel] = curve[from[k]];
    });
    return texels;
}

/** Fill all maps. @param {Made} made */
export async function fillMaps(made) {
    await Promise.all(Object.keys(made.scene.maps).map((number) => fillMap(made, Number(number))));
}

/** @param {Made} made @param {number} number */
async function fillMap(made, number) {
    const { width, height } = made.resource(number);
    await Promise.all(
        made.scene.maps[number].flatMap((layers, mip) =>
            layers.map(async (layer, k) => {
                const size = [Math.max(1, width >> mip), Math.max(1, height >> mip)];
                putTexels(made, number, texelsOf(await stepsOf(made, layer, size[0], size[1])), mip, k);
            }),
        ),
    );
    await halve(made, number);
}

/**
 * Put texels into a mip of a layer.
 * @param {Made} made @param {number} number @param {Uint16Array} texels @param {number} mip @param {number} layer
 */
export function putTexels(made, number, texels, mip = 0, layer = 0) {
    const texture = made.resource(number);
    const [width, height] = [Math.max(1, texture.width >> mip), Math.max(1, texture.height >> mip)];
    const bytesPerRow = (texels.length / height) * 2;
    const to = { texture, mipLevel: mip, origin: [0, 0, layer] };
    made.device.queue.writeTexture(to, /** @type {any} */ (texels), { bytesPerRow, rowsPerImage: height }, [width, height, 1]);
}

/** Fill a map's other mips from its first. @param {Made} made @param {number} number */
export async function halve(made, number) {
    const passes = made.scene.halved[number] ?? [];
    const pipelines = await Promise.all(passes.map((one) => made.pipeline(one.program)));
    const encoder = made.device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    passes.forEach((one, k) => {
        pass.setPipeline(pipelines[k]);
        pass.setBindGroup(0, made.group(one, noRecord));
        pass.dispatchWorkgroups(one.groups[0], one.groups[1], one.groups[2]);
    });
    pass.end();
    made.device.queue.submit([encoder.finish()]);
}

/** @returns {never} */
function noRecord() {
    throw new Error("halving reads no record");
}
