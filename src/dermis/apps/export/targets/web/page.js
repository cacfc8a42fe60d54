// The page: opens a device, draws the frame that fits the window, and handles input.

import { GpuScene } from "./device.js";
import { addInputHandlers, element } from "./input.js";
import { fillMaps, fillMips, writeTexels } from "./maps.js";
import { mixColourMap } from "./mixing.js";
import { decodeSevenBits, gunzip } from "./packed.js";
import { Player } from "./player.js";
import { Screen } from "./screen.js";
import { applyState, defaultState } from "./state.js";

/** @typedef {import("./state.js").Slider} Slider */
/** @typedef {import("./device.js").Scene} Scene */
/** @typedef {{forms: Record<string, Scene>, blobs: import("./packed.js").Run[], images: number[], dials: Slider[]}} File */

const [BEFORE, AFTER] = ["none", "texture-space"];
const REST_MS = 400;
const NO_WEBGPU = "This head needs WebGPU: Chrome or Edge 113, Safari 26, Firefox 141 or later, with a supported graphics driver. A still picture is shown instead.";

/** @param {string} message @param {string} state */
function showMessage(message, state) {
    element("told").textContent = message;
    document.documentElement.dataset.state = state;
}

/** @param {string} id */
const readElement = (id) => decodeSevenBits(element(id).textContent);

/** Read the description of the frames. @returns {Promise<File>} */
async function readFile() {
    return JSON.parse(new TextDecoder().decode(await gunzip(readElement("scene"))));
}

/** Read the contents of buffers and maps. @param {File} file @returns {Promise<import("./device.js").Store>} */
async function readStore(file) {
    await new Promise((done) => setTimeout(done)); // lets compilation start first
    const data = gunzip(readElement("data"));
    const pictureBytes = readElement("pictures");
    let end = 0;
    const pictures = file.images.map((size) => pictureBytes.subarray(end, (end += size)));
    return { blobs: file.blobs, data: await data, pictures };
}

/** State of the page. */
class Page {
    /** @param {File} file */
    constructor(file) {
        this.file = file;
        /** @type {import("./device.js").Store | null} */
        this.store = null;
        this.state = defaultState(file.dials);
        this.technique = AFTER;
        /** @type {Map<import("./device.js").Frame, Player>} */
        this.players = new Map();
        this.dirty = true;
        this.busy = false;
        this.paintedState = "";
        this.frames = 0;
        /** @type {Player | null} */
        this.player = null;
        /** @type {Screen | null} */
        this.screen = null;
        this.soft = false;
        this.moving = false;
        this.restTimer = 0;
    }

    /** Open a device and draw; also called after a device was lost. */
    async open() {
        const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
        if (!adapter) return showMessage(NO_WEBGPU, "without");
        const options = new URLSearchParams(location.hash.slice(1));
        const soft = adapter.info.isFallbackAdapter || /swiftshader|llvmpipe/i.test(adapter.info.architecture + adapter.info.description);
        const form = options.get("form") ?? (soft ? "software" : "gpu");
        const scene = this.file.forms[form] ?? Object.values(this.file.forms)[0];
        const device = await adapter.requestDevice({ requiredLimits: limitsFor(scene, adapter.limits) });
        device.lost.then(async (info) => {
            if (info.reason !== "destroyed") await this.reopen();
        });
        device.addEventListener("uncapturederror", (event) => showMessage(`The graphics device reported an error: ${/** @type {GPUUncapturedErrorEvent} */ (event).error.message}`, "failed"));
        const gpuScene = new GpuScene(device, scene);
        gpuScene.compile(this.#fitting(scene));
        gpuScene.store = this.store ??= await readStore(this.file);
        this.gpuScene = gpuScene;
        this.players.clear();
        this.paintedState = "";
        this.soft = soft;
        this.screen = null;
        const maps = fillMaps(gpuScene);
        this.choose();
        await maps;
        this.dirty = true;
        await this.draw();
        showMessage("", "drawn");
        for (const one of scene.frames) if (one.moving && one.name === this.technique) gpuScene.compile(one);
    }

    async reopen() {
        showMessage("The graphics device was lost and is opened again …", "loading");
        await this.open().catch(showError);
    }

    /** Wait until everything is drawn. */
    async idle() {
        while (this.dirty || this.busy) await new Promise((done) => setTimeout(done, 1));
    }

    /** Return the frame for the technique, the window size, and whether there is interaction. @param {Scene} scene */
    #fitting(scene) {
        const side = Math.min(innerWidth, innerHeight) * devicePixelRatio;
        const fitting = scene.frames.filter((one) => one.name === this.technique);
        const moving = this.moving && fitting.find((one) => one.moving);
        const still = fitting.filter((one) => !one.moving);
        return moving || (still.find((one) => one.size[0] >= 0.9 * side) ?? still[still.length - 1]);
    }

    /** Select the player of the frame that fits. */
    choose() {
        const { gpuScene } = this;
        if (!gpuScene) return;
        const frame = this.#fitting(gpuScene.scene);
        if (!this.players.has(frame)) {
            const player = new Player(gpuScene, frame);
            player.prepare();
            this.players.set(frame, player);
        }
        this.player = /** @type {Player} */ (this.players.get(frame));
        if (this.screen?.frame !== frame) {
            this.screen?.close();
            this.screen = new Screen(element("picture"), gpuScene, frame, this.soft);
        }
        this.dirty = true;
    }

    /** Draw if anything changed, and wait until it is shown; one frame at a time. */
    async draw() {
        if (!this.dirty || this.busy || !this.player || !this.gpuScene || !this.screen) return;
        [this.dirty, this.busy] = [false, true];
        try {
            if (this.soft) this.choose();
            this.dirty = false;
            await this.#frame(this.player, this.gpuScene, /** @type {Screen} */ (this.screen));
        } finally {
            this.busy = false;
        }
        clearTimeout(this.restTimer);
        if (this.moving) this.restTimer = setTimeout(() => this.rest(), REST_MS);
    }

    /** @param {Player} player @param {GpuScene} gpuScene @param {Screen} screen */
    async #frame(player, gpuScene, screen) {
        const start_ms = performance.now();
        applyState(player, this.file.dials, this.state);
        await this.#paint(gpuScene);
        const encoder = await player.draw();
        screen.copy(encoder);
        gpuScene.device.queue.submit([encoder.finish()]);
        await screen.show();
        this.frames++;
        element("time").textContent = `${(performance.now() - start_ms).toFixed(0)} ms`;
        element("poster").hidden = true;
    }

    /** Update the colour map for the values of sliders. @param {GpuScene} gpuScene */
    async #paint(gpuScene) {
        const { map, dials } = gpuScene.scene.colours;
        const changed = this.file.dials.filter((one) => dials?.[one.name] && this.state.dials[one.name] !== one.rest);
        const key = changed.map((one) => `${one.name} ${this.state.dials[one.name]}`).join();
        if (key === this.paintedState) return;
        this.paintedState = key;
        writeTexels(gpuScene, map, await mixColourMap(gpuScene, changed, this.state.dials));
        await fillMips(gpuScene, map);
        gpuScene.slot(map).version++;
    }

    /** @param {string} technique */
    async setTechnique(technique) {
        this.technique = technique;
        this.choose();
        await this.draw();
    }

    /** Request a new frame after input; software adapters draw smaller pictures until input ends. */
    touch() {
        this.dirty = true;
        if (!this.soft) return;
        this.moving = true;
        clearTimeout(this.restTimer);
    }

    rest() {
        this.moving = false;
        this.dirty = true;
    }
}

/** Return the limits that the resources of a scene need beyond the defaults. @param {Scene} scene @param {GPUSupportedLimits} offered */
function limitsFor(scene, offered) {
    const buffers = scene.resources.flatMap((one) => (one.kind === "buffer" ? [one.size] : []));
    const largest = Math.max(...buffers);
    /** @type {Record<string, number>} */
    const limits = {};
    if (largest > 128 << 20) limits.maxStorageBufferBindingSize = Math.min(largest, offered.maxStorageBufferBindingSize);
    if (largest > 256 << 20) limits.maxBufferSize = Math.min(largest, offered.maxBufferSize);
    return limits;
}

/** @param {unknown} error */
function showError(error) {
    showMessage(`The head could not be drawn: ${error instanceof Error ? error.message : error}`, "failed");
}

/** Add the sliders to the panel. @param {Page} page */
function addSliders(page) {
    for (const slider of page.file.dials) {
        const label = document.createElement("label");
        const input = document.createElement("input");
        const [min, max] = [slider.values[0], slider.values[slider.values.length - 1]];
        Object.assign(input, { type: "range", min, max, step: (max - min) / 200, value: slider.rest });
        input.addEventListener("input", () => {
            page.state.dials[slider.name] = Number(input.value);
            page.touch();
        });
        label.append(slider.name, input);
        element("dials").append(label);
    }
    element("after").addEventListener("change", () => page.setTechnique(element("after").checked ? AFTER : BEFORE).catch(showError));
}

async function start() {
    if (!navigator.gpu) return showMessage(NO_WEBGPU, "without");
    const page = new Page(await readFile());
    addSliders(page);
    addInputHandlers(page, showError);
    await page.open();
    const next = () => requestAnimationFrame(() => page.draw().catch(showError).finally(next));
    next();
    Object.assign(window, { dermis: page });
}

start().catch(showError);
