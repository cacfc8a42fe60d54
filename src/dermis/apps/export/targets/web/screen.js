// Where a picture is shown: a canvas that the device fills, or where it is software one that the page fills.

/** @typedef {import("./device.js").Made} Made */
/** @typedef {import("./device.js").Frame} Frame */

/** Shows pictures of one size. */
export class Screen {
    /** @param {HTMLCanvasElement} canvas @param {Made} made @param {Frame} frame @param {boolean} soft */
    constructor(canvas, made, frame, soft) {
        const [width, height] = (this.size = frame.size);
        this.canvas = canvas;
        if (!soft) [canvas.width, canvas.height] = frame.size;
        this.made = made;
        this.frame = frame;
        this.layout = { bytesPerRow: Math.ceil((4 * width) / 256) * 256, rowsPerImage: height };
        const usage = GPUBufferUsage.COPY_DST | (soft ? GPUBufferUsage.MAP_READ : GPUBufferUsage.COPY_SRC);
        this.buffer = made.device.createBuffer({ size: this.layout.bytesPerRow * height, usage });
        this.plain = soft ? canvas.getContext("2d") : null;
        this.context = soft ? null : /** @type {GPUCanvasContext | null} */ (/** @type {unknown} */ (canvas.getContext("webgpu")));
        this.context?.configure({
            device: made.device,
            format: "rgba8unorm",
            alphaMode: "opaque",
            usage: GPUTextureUsage.COPY_DST | GPUTextureUsage.RENDER_ATTACHMENT,
        });
    }

    /** Copy the frame's picture. @param {GPUCommandEncoder} encoder */
    copy(encoder) {
        const from = { buffer: this.buffer, ...this.layout };
        encoder.copyTextureToBuffer({ texture: this.made.resource(this.frame.picture) }, from, this.size);
        if (this.context) encoder.copyBufferToTexture(from, { texture: this.context.getCurrentTexture() }, this.size);
    }

    /** Wait until what was submitted is there. */
    async show() {
        await this.made.device.queue.onSubmittedWorkDone();
        if (!this.plain) return;
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
        this.plain.putImageData(image, 0, 0);
    }

    /** Give its memory back. */
    close() {
        this.buffer.destroy();
    }
}
