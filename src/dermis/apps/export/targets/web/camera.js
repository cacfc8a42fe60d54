// Projections of the camera and of a light, as in frame/projection.py; vectors are [x, y, z] in mm.

/** @typedef {number[]} Vec */
/**
 * @typedef {{position: Vec, target: Vec, up: Vec, half: number[], shift: number[]}} Camera
 * @typedef {{position: Vec, target: Vec, softness: number}} SpotLight
 * @typedef {{centre: Vec, camera: Camera, samples: number[][], outline: number[], slack: number, middle: Vec,
 *     shadow_size: number, lights: (SpotLight | null)[]}} Interaction
 */

const MIN_DISTANCE_MM = 1.0;
const MAX_FILTER = 6;

/** @param {Vec} a @param {Vec} b */
export const add = (a, b) => a.map((x, k) => x + b[k]);
/** @param {Vec} a @param {Vec} b */
export const subtract = (a, b) => a.map((x, k) => x - b[k]);
/** @param {number} s @param {Vec} a */
export const multiply = (s, a) => a.map((x) => s * x);
/** @param {Vec} a @param {Vec} b */
export const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
/** @param {Vec} a */
export const normalize = (a) => multiply(1 / Math.hypot(...a), a);
/** @param {Vec} a @param {Vec} b */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** Return the unit vectors to the right, up and forward. @param {Vec} forward @param {Vec} up */
export function viewAxes(forward, up) {
    const ahead = normalize(forward);
    let right = cross(ahead, up);
    if (Math.hypot(...right) <= 1e-6 * Math.hypot(...up)) {
        right = cross(ahead, Math.abs(ahead[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1]);
    }
    right = normalize(right);
    return [right, cross(right, ahead), ahead];
}

/** Return the upper three rows of the view matrix. @param {Vec} eye @param {Vec[]} axes */
export const viewRows = (eye, axes) => axes.map((axis) => [...axis, -dot(axis, eye)]);

/**
 * Return the rows of the matrix to clip space, with depth 1 at near and 0 at far.
 * @param {Vec[]} rows @param {number[]} half @param {number[]} shift @param {number} near @param {number} far
 */
export function perspective(rows, half, shift, near, far) {
    const scale = -near / (far - near);
    const depth = multiply(scale, rows[2]);
    depth[3] -= far * scale;
    const lateral = [0, 1].map((k) => rows[k].map((c, i) => c / half[k] - shift[k] * rows[2][i]));
    return [...lateral, depth, rows[2]];
}

/** Return the minimum and maximum of a coordinate of the outline, given by a row of a matrix. @param {Interaction} hands @param {Vec} row */
function outlineRange({ outline }, row) {
    let [low, high] = [Infinity, -Infinity];
    for (let k = 0; k < outline.length; k += 3) {
        const z = row[0] * outline[k] + row[1] * outline[k + 1] + row[2] * outline[k + 2] + row[3];
        low = Math.min(low, z);
        high = Math.max(high, z);
    }
    return [low, high];
}

/**
 * Return the position, axes and matrix to clip space of a camera whose depth range encloses the head.
 * @param {Interaction} hands @param {Camera} camera
 */
export function cameraView(hands, camera) {
    const eye = add(camera.position, hands.centre);
    const axes = viewAxes(subtract(camera.target, camera.position), camera.up);
    const rows = viewRows(eye, axes);
    const [low, high] = outlineRange(hands, rows[2]);
    const far = high + hands.slack;
    const near = Math.max(low - hands.slack - 1, 0.5, 1e-3 * far);
    const clip = perspective(rows, camera.half, camera.shift, near, Math.max(far + 1, 2));
    const [right, up, forward] = axes;
    return { eye, forward, right: multiply(camera.half[0], right), up: multiply(camera.half[1], up), shift: camera.shift, clip };
}

/** Return the projection of the smallest shadow map that encloses the head; null if the light is too near. @param {Interaction} hands @param {SpotLight} light */
export function lightView(hands, light) {
    const position = add(light.position, hands.centre);
    const axes = viewAxes(subtract(hands.middle, position), [0, 1, 0]);
    const rows = viewRows(position, axes);
    const [near, far] = outlineRange(hands, rows[2]);
    if (near <= MIN_DISTANCE_MM) return null;
    let maxSlope = 0;
    for (let k = 0; k < hands.outline.length; k += 3) {
        const p = [hands.outline[k], hands.outline[k + 1], hands.outline[k + 2], 1];
        const depth = dot(rows[2], p);
        maxSlope = Math.max(maxSlope, Math.abs(dot(rows[0], p)) / depth, Math.abs(dot(rows[1], p)) / depth);
    }
    const half = 1.02 * maxSlope;
    const bounds = [Math.max(0.98 * near - hands.slack, 0.1 * near), 1.02 * far + hands.slack];
    const axis = subtract(light.target, light.position);
    const texel = (2 * half) / hands.shadow_size;
    const filter = Math.round((0.5 * light.softness) / (texel * Math.hypot(...axis)));
    return {
        to_map: perspective(rows, [half, half], [0, 0], bounds[0], bounds[1]),
        position,
        direction: normalize(axis),
        reference_mm: Math.hypot(...axis),
        texel,
        map_right: axes[0],
        map_up: axes[1],
        map_near: bounds[0],
        map_far: bounds[1],
        half_width: Math.min(Math.max(filter, 1), MAX_FILTER),
    };
}

/** Return the matrix to clip space, shifted so that pixel centres lie at a sample of the pixel. @param {Vec[]} clip @param {number[]} sample @param {number[]} size */
export function shiftToSample(clip, sample, size) {
    const offset = [(sample[0] - 0.5) * (-2 / size[0]), (sample[1] - 0.5) * (2 / size[1])];
    return clip.map((row, k) => (k < 2 ? row.map((c, i) => c + offset[k] * clip[3][i]) : row));
}

/** Return the elements of a matrix in column-major order. @param {Vec[]} rows */
export const columnMajor = (rows) => [0, 1, 2, 3].flatMap((i) => rows.map((row) => row[i]));

/**
 * Return a camera rotated about its target by angles [rad], with its distance multiplied by a factor.
 * @param {Camera} camera @param {number} yaw @param {number} pitch @param {number} zoom
 */
export function orbitCamera(camera, yaw, pitch, zoom) {
    return { ...camera, position: add(camera.target, multiply(zoom, rotateOffset(subtract(camera.position, camera.target), yaw, pitch))) };
}

/** Return an offset rotated about the vertical by yaw, and up by pitch [rad]. @param {Vec} offset @param {number} yaw @param {number} pitch */
export function rotateOffset(offset, yaw, pitch) {
    const length = Math.hypot(...offset);
    const azimuth = Math.atan2(offset[0], offset[2]) + yaw;
    const elevation = Math.max(-1.5, Math.min(1.5, Math.asin(offset[1] / length) + pitch));
    const horizontal = length * Math.cos(elevation);
    return [horizontal * Math.sin(azimuth), length * Math.sin(elevation), horizontal * Math.cos(azimuth)];
}
