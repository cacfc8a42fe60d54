// Where the camera and a light see the head from, as frame/projection.py has it; vectors are [x, y, z] in mm.

/** @typedef {number[]} Vec */
/**
 * @typedef {{position: Vec, target: Vec, up: Vec, half: number[], shift: number[]}} Camera
 * @typedef {{position: Vec, target: Vec, softness: number}} Spot
 * @typedef {{centre: Vec, camera: Camera, samples: number[][], outline: number[], slack: number, middle: Vec,
 *     shadow_size: number, lights: (Spot | null)[]}} Hands
 */

const NEAREST_MM = 1.0;
const WIDEST_FILTER = 6;

/** @param {Vec} a @param {Vec} b */
export const add = (a, b) => a.map((x, k) => x + b[k]);
/** @param {Vec} a @param {Vec} b */
export const less = (a, b) => a.map((x, k) => x - b[k]);
/** @param {number} s @param {Vec} a */
export const times = (s, a) => a.map((x) => s * x);
/** @param {Vec} a @param {Vec} b */
export const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
/** @param {Vec} a */
export const unit = (a) => times(1 / Math.hypot(...a), a);
/** @param {Vec} a @param {Vec} b */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** Right, up and forward. @param {Vec} forward @param {Vec} up */
export function axesOf(forward, up) {
    const ahead = unit(forward);
    let right = cross(ahead, up);
    if (Math.hypot(...right) <= 1e-6 * Math.hypot(...up)) {
        right = cross(ahead, Math.abs(ahead[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1]);
    }
    right = unit(right);
    return [right, cross(right, ahead), ahead];
}

/** The upper three rows of the view matrix. @param {Vec} eye @param {Vec[]} axes */
export const rowsOf = (eye, axes) => axes.map((axis) => [...axis, -dot(axis, eye)]);

/**
 * Rows of the matrix to clip space; depth 1 at near, 0 at far.
 * @param {Vec[]} rows @param {number[]} half @param {number[]} shift @param {number} near @param {number} far
 */
export function perspective(rows, half, shift, near, far) {
    const scale = -near / (far - near);
    const depth = times(scale, rows[2]);
    depth[3] -= far * scale;
    const across = [0, 1].map((k) => rows[k].map((c, i) => c / half[k] - shift[k] * rows[2][i]));
    return [...across, depth, rows[2]];
}

/** Least and largest of what rows make of the outline's places. @param {Hands} hands @param {Vec} row */
function range({ outline }, row) {
    let [low, high] = [Infinity, -Infinity];
    for (let k = 0; k < outline.length; k += 3) {
        const z = row[0] * outline[k] + row[1] * outline[k + 1] + row[2] * outline[k + 2] + row[3];
        low = Math.min(low, z);
        high = Math.max(high, z);
    }
    return [low, high];
}

/**
 * How a camera sees the head: where it is, what its picture spans, and its matrix to clip space.
 * @param {Hands} hands @param {Camera} camera
 */
export function cameraView(hands, camera) {
    const eye = add(camera.position, hands.centre);
    const axes = axesOf(less(camera.target, camera.position), camera.up);
    const rows = rowsOf(eye, axes);
    const [low, high] = range(hands, rows[2]);
    const far = high + hands.slack;
    const near = Math.max(low - hands.slack - 1, 0.5, 1e-3 * far);
    const clip = perspective(rows, camera.half, camera.shift, near, Math.max(far + 1, 2));
    const [right, up, forward] = axes;
    return { eye, forward, right: times(camera.half[0], right), up: times(camera.half[1], up), shift: camera.shift, clip };
}

/** The tightest shadow map around the head. @param {Hands} hands @param {Spot} light */
export function lightView(hands, light) {
    const position = add(light.position, hands.centre);
    const axes = axesOf(less(hands.middle, position), [0, 1, 0]);
    const rows = rowsOf(position, axes);
    const [near, far] = range(hands, rows[2]);
    if (near <= NEAREST_MM) return null;
    let steepest = 0;
    for (let k = 0; k < hands.outline.length; k += 3) {
        const p = [hands.outline[k], hands.outline[k + 1], hands.outline[k + 2], 1];
        const depth = dot(rows[2], p);
        steepest = Math.max(steepest, Math.abs(dot(rows[0], p)) / depth, Math.abs(dot(rows[1], p)) / depth);
    }
    const half = 1.02 * steepest;
    const bounds = [Math.max(0.98 * near - hands.slack, 0.1 * near), 1.02 * far + hands.slack];
    const along = less(light.target, light.position);
    const texel = (2 * half) / hands.shadow_size;
    const filter = Math.round((0.5 * light.softness) / (texel * Math.hypot(...along)));
    return {
        to_map: perspective(rows, [half, half], [0, 0], bounds[0], bounds[1]),
        position,
        direction: unit(along),
        reference_mm: Math.hypot(...along),
        texel,
        map_right: axes[0],
        map_up: axes[1],
        map_near: bounds[0],
        map_far: bounds[1],
        half_width: Math.min(Math.max(filter, 1), WIDEST_FILTER),
    };
}

/** The matrix for a sample that lies beside the middle of its pixel. @param {Vec[]} clip @param {number[]} place @param {number[]} size */
export function sampled(clip, place, size) {
    const moved = [(place[0] - 0.5) * (-2 / size[0]), (place[1] - 0.5) * (2 / size[1])];
    return clip.map((row, k) => (k < 2 ? row.map((c, i) => c + moved[k] * clip[3][i]) : row));
}

/** A matrix column by column, as shaders have it. @param {Vec[]} rows */
export const columns = (rows) => [0, 1, 2, 3].flatMap((i) => rows.map((row) => row[i]));

/**
 * A camera turned about its target: angles [rad], and a factor of its distance.
 * @param {Camera} camera @param {number} yaw @param {number} pitch @param {number} zoom
 */
export function orbited(camera, yaw, pitch, zoom) {
    return { ...camera, position: add(camera.target, times(zoom, turned(less(camera.position, camera.target), yaw, pitch))) };
}

/** An offset turned about the vertical, and up or down. @param {Vec} offset @param {number} yaw @param {number} pitch */
export function turned(offset, yaw, pitch) {
    const length = Math.hypot(...offset);
    const azimuth = Math.atan2(offset[0], offset[2]) + yaw;
    const rise = Math.max(-1.5, Math.min(1.5, Math.asin(offset[1] / length) + pitch));
    const level = length * Math.cos(rise);
    return [level * Math.sin(azimuth), length * Math.sin(rise), level * Math.cos(azimuth)];
}
