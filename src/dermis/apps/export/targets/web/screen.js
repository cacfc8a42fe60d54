// Display of pictures on the canvas: written by the device, or by the page if the adapter is software.

/** @typedef {import("./device.js").GpuScene} GpuScene */
/** @typedef {import("./device.js").Frame} Frame */

/** Canvas with pictures of one size. */
export class Screen {
    /** @param {HTMLCanvasElement} canvas @param {GpuScene} gpuScene @param {Frame} frame @param {boolean} software */
    constructor(canvas, gpuScene, frame, software) {
        const [width, height] = (this.size = frame.size);
        this.canvas = canvas;
        if (!software) [canvas.width, canvas.height] = frame.size;
        this.gpuScene = gpuScene;
        this.frame = frame;
        this.layout = { bytesPerRow: Math.ceil((4 * width) / 256) * 256, rowsPerImage: height };
        const usage = GPUBufferUsage.COPY_DST | (software ? GPUBufferUsage.MAP_READ : GPUBufferUsage.COPY_SRC);
        this.buffer = gpuScene.device.createBuffer({ size: this.layout.bytesPerRow * height, usage });
        this.context2d = software ? canvas.getContext("2d") : null;
        this.context = software ? null : /** @type {GPUCanvasContext | null} */ (/** @type {unknown} */ (canvas.getContext("webgpu")));
        this.context?.configure({
            device: gpuScene.device,
            format: "rgba8unorm",
            alphaMode: "opaque",
            usage: GPUTextureUsage.COPY_DST | GPUTextureUsage.RENDER_ATTACHMENT,
        });
    }

    /** Copy the picture of the frame to the canvas or a buffer. @param {GPUCommandEncoder} encoder */
    copy(encoder) {
        const from = { buffer: this.buffer, ...this.layout };
        encoder.copyTextureToBuffer({ texture: this.gpuScene.resource(this.frame.picture) }, from, this.size);
        if (this.context) encoder.copyBufferToTexture(from, { texture: this.context.getCurrentTexture() }, this.size);
    }

    /** Wait for submitted work, and show the picture if the adapter is software. */
    async show() {
        await this.gpuScene.device.queue.onSubmittedWorkDone();
        if (!this.context2d) return;
        await this.buffer.mapAsync(GPUMapMode.READ);
        const [width, height] = this.size;
        if (this.canvas.width !== width) [this.canvas.width, this.canvas.height] = this.size;
        const bytes = new Uint8Array(this.buffer.getMappedRange());
        const image = new ImageData(width, height);
        for (let y = 0; y < height; y++) {
            const start = y * this.layout.bytesPerRow;
            image.data.set(bytes.subarray(start, start + 4 * width), 4 * width * y);
        }
        this.buffer.unmap();
        for (let k = 3; k < image.data.length; k += 4) image.data[k] = 255;
        this.context2d.putImageData(image, 0, 0);
    }

    /** Release the memory. */
    close() {
        this.buffer.destroy();
    }
}
