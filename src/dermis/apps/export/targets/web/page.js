// The page: opens a device, plays the frame that fits, and listens to hands.

import { Made } from "./device.js";
import { element, listen } from "./hands.js";
import { fillMaps, halve, putTexels } from "./maps.js";
import { mixed } from "./mixing.js";
import { bytesOf, inflated } from "./packed.js";
import { Player } from "./player.js";
import { Screen } from "./screen.js";
import { apply, atRest } from "./turned.js";

/** @typedef {import("./turned.js").Dial} Dial */
/** @typedef {import("./device.js").Scene} Scene */
/** @typedef {{forms: Record<string, Scene>, blobs: import("./packed.js").Run[], images: number[], dials: Dial[]}} File */

const [BEFORE, AFTER] = ["none", "texture-space"];
const REST_MS = 400;
const NO_WEBGPU = "This head needs WebGPU: Chrome or Edge 113, Safari 26, Firefox 141 or later, on a device whose graphics driver they accept. Above is a still picture of it.";

/** @param {string} words @param {string} state */
function tell(words, state) {
    element("told").textContent = words;
    document.documentElement.dataset.state = state;
}

/** @param {string} id */
const part = (id) => bytesOf(element(id).textContent);

/** What there is to draw. @returns {Promise<File>} */
async function readFile() {
    return JSON.parse(new TextDecoder().decode(await inflated(part("scene"))));
}

/** Numbers and pictures of a file. @param {File} file @returns {Promise<import("./device.js").Store>} */
async function readStore(file) {
    await new Promise((done) => setTimeout(done)); // what was asked of the device goes first
    const data = inflated(part("data"));
    const all = part("pictures");
    let end = 0;
    const pictures = file.images.map((size) => all.subarray(end, (end += size)));
    return { blobs: file.blobs, data: await data, pictures };
}

/** The page at work on one device. */
class Page {
    /** @param {File} file */
    constructor(file) {
        this.file = file;
        /** @type {import("./device.js").Store | null} */
        this.store = null;
        this.state = atRest(file.dials);
        this.technique = AFTER;
        /** @type {Map<import("./device.js").Frame, Player>} */
        this.players = new Map();
        this.dirty = true;
        this.busy = false;
        this.painted = "";
        this.frames = 0;
        /** @type {Player | null} */
        this.player = null;
        /** @type {Screen | null} */
        this.screen = null;
        this.soft = false;
        this.moving = false;
        this.resting = 0;
    }

    /** Open a device, again after a loss. */
    async open() {
        const adapter = await navigator.gpu?.requestAdapter({ powerPreference: "high-performance" });
        if (!adapter) return tell(NO_WEBGPU, "without");
        const wanted = new URLSearchParams(location.hash.slice(1));
        const soft = adapter.info.isFallbackAdapter || /swiftshader|llvmpipe/i.test(adapter.info.architecture + adapter.info.description);
        const form = wanted.get("form") ?? (soft ? "software" : "gpu");
        const scene = this.file.forms[form] ?? Object.values(this.file.forms)[0];
        const device = await adapter.requestDevice({ requiredLimits: limitsFor(scene, adapter.limits) });
        device.lost.then(async (info) => {
            if (info.reason !== "destroyed") await this.reopen();
        });
        device.addEventListener("uncapturederror", (event) => tell(`The device refused: ${/** @type {GPUUncapturedErrorEvent} */ (event).error.message}`, "failed"));
        const made = new Made(device, scene);
        made.compile(this.#fitting(scene));
        made.store = this.store ??= await readStore(this.file);
        this.made = made;
        this.players.clear();
        this.painted = "";
        this.soft = soft;
        this.screen = null;
        const maps = fillMaps(made);
        this.choose();
        await maps;
        this.dirty = true;
        await this.draw();
        tell("", "drawn");
        for (const one of scene.frames) if (one.moving && one.name === this.technique) made.compile(one);
    }

    async reopen() {
        tell("The graphics device was lost; it is opened again …", "loading");
        await this.open().catch(failed);
    }

    /** When all is drawn. */
    async idle() {
        while (this.dirty || this.busy) await new Promise((done) => setTimeout(done, 1));
    }

    /** The frame for the technique, the size of the window and what hands do. @param {Scene} scene */
    #fitting(scene) {
        const side = Math.min(innerWidth, innerHeight) * devicePixelRatio;
        const fitting = scene.frames.filter((one) => one.name === this.technique);
        const moving = this.moving && fitting.find((one) => one.moving);
        const still = fitting.filter((one) => !one.moving);
        return moving || (still.find((one) => one.size[0] >= 0.9 * side) ?? still[still.length - 1]);
    }

    /** The player for it. */
    choose() {
        const { made } = this;
        if (!made) return;
        const frame = this.#fitting(made.scene);
        if (!this.players.has(frame)) {
            const player = new Player(made, frame);
            player.prepare();
            this.players.set(frame, player);
        }
        this.player = /** @type {Player} */ (this.players.get(frame));
        if (this.screen?.frame !== frame) {
            this.screen?.close();
            this.screen = new Screen(element("picture"), made, frame, this.soft);
        }
        this.dirty = true;
    }

    /** Draw what is stale, and wait until it is there: one frame at a time. */
    async draw() {
        if (!this.dirty || this.busy || !this.player || !this.made || !this.screen) return;
        [this.dirty, this.busy] = [false, true];
        try {
            if (this.soft) this.choose();
            this.dirty = false;
            await this.#frame(this.player, this.made, /** @type {Screen} */ (this.screen));
        } finally {
            this.busy = false;
        }
        clearTimeout(this.resting);
        if (this.moving) this.resting = setTimeout(() => this.rest(), REST_MS);
    }

    /** @param {Player} player @param {Made} made @param {Screen} screen */
    async #frame(player, made, screen) {
        const began = performance.now();
        apply(player, this.file.dials, this.state);
        await this.#paint(made);
        const encoder = await player.draw();
        screen.copy(encoder);
        made.device.queue.submit([encoder.finish()]);
        await screen.show();
        this.frames++;
        element("time").textContent = `${(performance.now() - began).toFixed(0)} ms`;
        element("poster").hidden = true;
    }

    /** Mix the colour map where dials change it. @param {Made} made */
    async #paint(made) {
        const { map, dials } = made.scene.colours;
        const turned = this.file.dials.filter((one) => dials?.[one.name] && this.state.dials[one.name] !== one.rest);
        const key = turned.map((one) => `${one.name} ${this.state.dials[one.name]}`).join();
        if (key === this.painted) return;
        this.painted = key;
        putTexels(made, map, await mixed(made, turned, this.state.dials));
        await halve(made, map);
        made.slot(map).held++;
    }

    /** @param {string} technique */
    async turnTo(technique) {
        this.technique = technique;
        this.choose();
        await this.draw();
    }

    /** What hands do: software draws smaller pictures until they rest. */
    touch() {
        this.dirty = true;
        if (!this.soft) return;
        this.moving = true;
        clearTimeout(this.resting);
    }

    rest() {
        this.moving = false;
        this.dirty = true;
    }
}

/** The limits that a scene's resources need, if they are above those that every device has. @param {Scene} scene @param {GPUSupportedLimits} offered */
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
function failed(error) {
    tell(`It could not be drawn: ${error instanceof Error ? error.message : error}`, "failed");
}

/** A slider for each dial. @param {Page} page */
function addDials(page) {
    for (const dial of page.file.dials) {
        const label = document.createElement("label");
        const slider = document.createElement("input");
        const [least, most] = [dial.values[0], dial.values[dial.values.length - 1]];
        Object.assign(slider, { type: "range", min: least, max: most, step: (most - least) / 200, value: dial.rest });
        slider.addEventListener("input", () => {
            page.state.dials[dial.name] = Number(slider.value);
            page.touch();
        });
        label.append(dial.name, slider);
        element("dials").append(label);
    }
    element("after").addEventListener("change", () => page.turnTo(element("after").checked ? AFTER : BEFORE).catch(failed));
}

async function start() {
    if (!navigator.gpu) return tell(NO_WEBGPU, "without");
    const page = new Page(await readFile());
    addDials(page);
    listen(page, failed);
    await page.open();
    const next = () => requestAnimationFrame(() => page.draw().catch(failed).finally(next));
    next();
    Object.assign(window, { dermis: page });
}

start().catch(failed);
