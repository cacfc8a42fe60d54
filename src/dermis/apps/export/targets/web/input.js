// Input by mouse, touch and keys: orbit, zoom, and rotation of the light.

/**
 * Page that input controls.
 * @typedef {{state: import("./state.js").ViewState, touch: () => void, choose: () => void,
 *     draw: () => Promise<void>}} Page
 */

/** @param {string} id @returns {any} */
export const element = (id) => document.getElementById(id);

/** Add handlers of pointer, wheel, key and resize events. @param {Page} page @param {(error: unknown) => void} showError */
export function addInputHandlers(page, showError) {
    const canvas = element("picture");
    /** @type {Map<number, {x: number, y: number}>} */
    const pointers = new Map();
    canvas.addEventListener("pointerdown", (/** @type {PointerEvent} */ event) => {
        canvas.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    for (const name of ["pointerup", "pointercancel"]) {
        canvas.addEventListener(name, (/** @type {PointerEvent} */ event) => pointers.delete(event.pointerId));
    }
    canvas.addEventListener("pointermove", (/** @type {PointerEvent} */ event) => {
        const last = pointers.get(event.pointerId);
        if (!last) return;
        const now = { x: event.clientX, y: event.clientY };
        const other = [...pointers].find(([id]) => id !== event.pointerId)?.[1];
        if (other) pinch(page, other, last, now);
        else drag(page, event.shiftKey || event.buttons === 2, now.x - last.x, now.y - last.y);
        pointers.set(event.pointerId, now);
    });
    canvas.addEventListener("contextmenu", (/** @type {Event} */ event) => event.preventDefault());
    canvas.addEventListener("wheel", (/** @type {WheelEvent} */ event) => {
        event.preventDefault();
        zoom(page, Math.exp(0.001 * event.deltaY));
    }, { passive: false });
    canvas.addEventListener("keydown", (/** @type {KeyboardEvent} */ event) => {
        const step = /** @type {Record<string, number[]>} */ ({ ArrowLeft: [20, 0], ArrowRight: [-20, 0], ArrowUp: [0, 20], ArrowDown: [0, -20] })[event.key];
        if (step) drag(page, event.shiftKey, step[0], step[1]);
        if (event.key === "+") zoom(page, 0.9);
        if (event.key === "-") zoom(page, 1.1);
    });
    addEventListener("resize", () => {
        page.choose();
        page.draw().catch(showError);
    });
}

/** @param {Page} page @param {boolean} light @param {number} x @param {number} y [pixel] */
function drag(page, light, x, y) {
    const { state } = page;
    const movesLight = light || element("light").checked;
    const radiansPerPixel = 0.006;
    if (movesLight) {
        state.lightYaw += radiansPerPixel * x;
        state.lightPitch = Math.max(-1.4, Math.min(1.4, state.lightPitch - radiansPerPixel * y));
    } else {
        state.yaw -= radiansPerPixel * x;
        state.pitch = Math.max(-1.4, Math.min(1.4, state.pitch + radiansPerPixel * y));
    }
    page.touch();
}

/** @param {Page} page @param {number} factor */
function zoom(page, factor) {
    page.state.zoom = Math.max(0.35, Math.min(2.5, page.state.zoom * factor));
    page.touch();
}

/** @param {Page} page @param {{x: number, y: number}} other @param {{x: number, y: number}} last @param {{x: number, y: number}} now */
function pinch(page, other, last, now) {
    const distance = (/** @type {{x: number, y: number}} */ one) => Math.max(1, Math.hypot(one.x - other.x, one.y - other.y));
    zoom(page, distance(last) / distance(now));
}
