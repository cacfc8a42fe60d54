// Moves the guides of long hair by one frame of position-based dynamics [Mueller2007]: inertia, gravity, springs towards the
// shape at which the skin holds them, and collisions with the skin. A workgroup simulates one guide, an invocation one knot.
//#include "swing_grid.wgsl"

//#fill const KNOTS_PER_GUIDE: u32 = {knots_per_guide}; // of each guide
const SUPPORT_HEIGHT_MM: f32 = 20.0; // height above the skin of the head up to which hair is held by the hair below it
const SUPPORT_Y_MM: f32 = -60.0; // height of the jaw relative to the eyes, below which hair hangs freely
const GRAVITY: f32 = 9810.0; // [mm/s2]
const CANTILEVER: f32 = 60000.0; // frequency of bending, times the square of the free length [mm2/s]
const MAX_FREQUENCY: f32 = 1000.0; // of the springs [1/s]
const MIN_LEVER_MM: f32 = 5.0;
const DAMPING_RATIO: f32 = 0.3; // of the springs, relative to critical damping
const DRAG: f32 = 1.0; // damping of all motion relative to the skin [1/s]
const FRICTION: f32 = 20.0; // more damping of hair that touches skin [1/s]
const BEND_STIFFNESS: f32 = 2000.0; // of the springs that keep the bends of the stiff guide [1/s2]
const LEAST_PIVOT: f32 = 1e-4;
const CLEARANCE_MM: f32 = 0.5; // distance that knots keep from skin, if they had it in the first frame
const MAX_PUSH_MM: f32 = 4.0; // by a collision, in one iteration
const ITERATIONS: u32 = 3u; // of collisions and lengths
const LAST_ITERATIONS: u32 = 5u; // of collisions and exact lengths, which do not change velocities
const MAX_SPEED: f32 = 4000.0; // [mm/s]
const FAR_MM: f32 = 16.0; // distance beyond which skin is not seen

// Knot of a guide between frames.
struct Knot {
    position: vec3f,
    length: f32, // of the segment before it [mm]
    velocity: vec3f, // [mm/s]
    clearance: f32, // distance that it keeps from skin [mm]
    shape: vec3f, // its position if hair were stiff
    lever: f32, // distance from where the head holds its guide [mm]
}

struct Skin {
    distance: f32, // signed, from the skin; FAR_MM if none is near [mm]
    normal: vec3f, // 0 if none is near
}

@group(0) @binding(0) var<storage, read> guide_rest: array<vec4f>; // see guides_pose.wgsl
@group(0) @binding(1) var<storage, read> guides: array<vec4f>; // stiff guides, see guides_pose.wgsl
@group(0) @binding(2) var<storage, read> knots_before: array<Knot>;
@group(0) @binding(3) var<storage, read_write> knots_now: array<Knot>;
@group(0) @binding(4) var<storage, read> colliders_before: array<vec4f>; // see swing_colliders.wgsl
@group(0) @binding(5) var<storage, read> colliders_now: array<vec4f>;
@group(0) @binding(6) var<storage, read> cells: array<u32>;
@group(0) @binding(7) var<storage, read_write> swung_guides: array<vec4f>;

var<workgroup> places: array<vec3f, KNOTS_PER_GUIDE>;
var<workgroup> shapes: array<vec3f, KNOTS_PER_GUIDE>; // places of a stiff guide
var<workgroup> lengths: array<f32, KNOTS_PER_GUIDE>;
var<workgroup> mobilities: array<f32, KNOTS_PER_GUIDE>; // inverse masses, which springs increase
var<workgroup> tensions: array<f32, KNOTS_PER_GUIDE>;
var<workgroup> ratios: array<f32, KNOTS_PER_GUIDE>;

// Nearest skin, averaged over the colliders of eight cells as in the growth of guides.
// shift: displacement of the skin near p until the end of the frame; rest: part of the frame that is left
fn nearest_skin(p: vec3f, shift: vec3f, rest: f32) -> Skin {
    let at = floor((p + shift - swing.low) / CELL_MM - 0.5);
    if (any(at < vec3f(0.0)) || any(at >= vec3f(GRID_CELLS - 1u))) {
        return Skin(FAR_MM, vec3f(0.0));
    }
    var normal = vec3f(0.0);
    var height = 0.0;
    for (var k = 0u; k < 8u; k += 1u) {
        let word = cells[grid_cell_index(vec3u(at) + vec3u(k & 1u, (k >> 1u) & 1u, k >> 2u))];
        if (word != NO_COLLIDER) {
            let row = 2u * (word & ((1u << INDEX_BITS) - 1u));
            let end = colliders_now[row].xyz;
            let away = p - mix(end, colliders_before[row].xyz, rest);
            let n = colliders_now[row + 1u].xyz;
            let weight = 1.0 / (dot(away, away) + 0.05);
            normal += weight * n;
            height += weight * dot(away, n);
        }
    }
    let size = length(normal);
    if (size == 0.0) {
        return Skin(FAR_MM, vec3f(0.0));
    }
    return Skin(min(height / size, FAR_MM), normal / size);
}

// Displacement that takes a knot out of the skin, see `nearest_skin`.
fn outward_push(p: vec3f, shift: vec3f, rest: f32, clearance: f32) -> vec3f {
    let skin = nearest_skin(p, shift, rest);
    return clamp(clearance - skin.distance, 0.0, MAX_PUSH_MM) * skin.normal;
}

// Distance of a knot at rest from the last place at which the head holds its guide [mm].
fn lever_of(first: u32, k: u32) -> f32 {
    var held = 0u;
    for (var i = 1u; i <= k; i += 1u) {
        let knot = guide_rest[first + i];
        held = select(held, i, knot.w < SUPPORT_HEIGHT_MM && knot.y > SUPPORT_Y_MM);
    }
    return distance(guide_rest[first + k].xyz, guide_rest[first + held].xyz);
}

// Change of the bend at a knot, relative to the stiff guide; 0 at the ends.
fn bend_error(k: u32) -> vec3f {
    if (k == 0u || k + 1u >= KNOTS_PER_GUIDE) {
        return vec3f(0.0);
    }
    return (places[k + 1u] - shapes[k + 1u]) - 2.0 * (places[k] - shapes[k]) + (places[k - 1u] - shapes[k - 1u]);
}

// Moves all knots so that the segments have their lengths to first order, without a change of momentum: a tridiagonal system of
// equations for the tensions [Han2013]. Knots with stiff springs move less.
fn relax_lengths() {
    var before = places[1] - places[0];
    var stretch = length(before);
    before = before / max(stretch, 1e-6);
    var pivot = mobilities[0] + mobilities[1] + LEAST_PIVOT;
    ratios[1] = 0.0;
    tensions[1] = (lengths[1] - stretch) / pivot;
    for (var i = 2u; i < KNOTS_PER_GUIDE; i += 1u) {
        var along = places[i] - places[i - 1u];
        stretch = length(along);
        along = along / max(stretch, 1e-6);
        let beside = -mobilities[i - 1u] * dot(before, along);
        ratios[i] = beside / pivot;
        pivot = mobilities[i - 1u] + mobilities[i] + LEAST_PIVOT - beside * ratios[i];
        tensions[i] = (lengths[i] - stretch - beside * tensions[i - 1u]) / pivot;
        before = along;
    }
    var pull = vec3f(0.0); // of the segment after a knot
    var tension = 0.0;
    for (var i = KNOTS_PER_GUIDE - 1u; i > 0u; i -= 1u) {
        let along = places[i] - places[i - 1u];
        tension = tensions[i] - select(0.0, ratios[min(i + 1u, KNOTS_PER_GUIDE - 1u)] * tension, i + 1u < KNOTS_PER_GUIDE);
        let own = tension / max(length(along), 1e-6) * along;
        places[i] += mobilities[i] * (own - pull);
        pull = own;
    }
}

// Restores the remaining errors of the lengths from root to tip. These corrections add no velocity, which would add energy.
fn restore_lengths() {
    for (var i = 1u; i < KNOTS_PER_GUIDE; i += 1u) {
        let before = places[i - 1u];
        let along = places[i] - before;
        places[i] = before + lengths[i] / max(length(along), 1e-6) * along;
    }
}

fn store(index: u32, knot: Knot, guide: vec4f, outward: vec4f) {
    let here = nearest_skin(knot.position, vec3f(0.0), 0.0);
    let stiff = nearest_skin(knot.shape, vec3f(0.0), 0.0);
    let height = guide.w + (here.distance - stiff.distance);
    let both = length(here.normal) > 0.0 && length(stiff.normal) > 0.0;
    let normal = select(outward.xyz, normalize((1.0 + 1e-6) * outward.xyz + here.normal - stiff.normal), both);
    knots_now[index] = knot;
    swung_guides[2u * index] = vec4f(knot.position, height);
    swung_guides[2u * index + 1u] = vec4f(normal, outward.w);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let k = min(lane, KNOTS_PER_GUIDE - 1u);
    let is_knot = lane < KNOTS_PER_GUIDE;
    let first = group.x * KNOTS_PER_GUIDE;
    let guide = guides[2u * (first + k)];
    let outward = guides[2u * (first + k) + 1u];
    if (swing.frame == 0u) {
        if (is_knot) {
            let edge = distance(guide.xyz, guides[2u * (first + max(k, 1u) - 1u)].xyz);
            let clearance = min(nearest_skin(guide.xyz, vec3f(0.0), 0.0).distance, CLEARANCE_MM);
            let knot = Knot(guide.xyz, edge, vec3f(0.0), clearance, guide.xyz, lever_of(first, k));
            store(first + k, knot, guide, outward);
        }
        return;
    }
    var knot = knots_before[first + k];
    let h = swing.step_s;
    let lever = max(knot.lever, MIN_LEVER_MM);
    let bending = CANTILEVER / (lever * lever);
    let frequency = min(sqrt(GRAVITY / lever + bending * bending), MAX_FREQUENCY);
    let spring = pow(h * frequency, 2.0);
    let mobility = select(1.0 / (1.0 + spring), 0.0, k == 0u);
    let bend = h * h * BEND_STIFFNESS / (1.0 + 6.0 * h * h * BEND_STIFFNESS);
    let damping = DRAG + 2.0 * DAMPING_RATIO * frequency;
    let begin = knot.shape;
    let shape_velocity = (guide.xyz - begin) / (f32(swing.substeps) * h);
    if (is_knot) {
        lengths[k] = knot.length;
        mobilities[k] = mobility;
    }
    for (var n = 1u; n <= swing.substeps; n += 1u) {
        let rest = 1.0 - f32(n) / f32(swing.substeps);
        let shape = mix(guide.xyz, begin, rest);
        var p = knot.position + h * (knot.velocity + h * swing.gravity);
        p = (p + spring * shape) / (1.0 + spring);
        p = select(p, shape, k == 0u);
        workgroupBarrier();
        if (is_knot) {
            places[k] = p;
            shapes[k] = shape;
        }
        workgroupBarrier();
        let errors = 2.0 * bend_error(k) - bend_error(max(k, 1u) - 1u) - bend_error(k + 1u);
        p += bend * mobility * errors;
        var pushed = vec3f(0.0);
        for (var i = 0u; i < ITERATIONS; i += 1u) {
            let push = select(outward_push(p, guide.xyz - shape, rest, knot.clearance), vec3f(0.0), k == 0u);
            pushed += push;
            p += push;
            workgroupBarrier();
            if (is_knot) {
                places[k] = p;
            }
            workgroupBarrier();
            if (lane == 0u) {
                relax_lengths();
            }
            workgroupBarrier();
            p = places[k];
        }
        workgroupBarrier(); // before `restore_lengths` writes `places` again
        let outwards = pushed / max(length(pushed), 1e-9); // 0 if the knot touches no skin
        var moved = (p - knot.position - pushed) / h - shape_velocity;
        moved -= min(dot(moved, outwards), 0.0) * outwards;
        let slowed = exp(-h * (damping + select(0.0, FRICTION, any(pushed != vec3f(0.0)))));
        knot.velocity = shape_velocity + min(slowed, MAX_SPEED / max(length(moved), 1e-6)) * moved;
        for (var i = 0u; i <= LAST_ITERATIONS; i += 1u) {
            if (lane == 0u) {
                restore_lengths();
            }
            workgroupBarrier();
            let here = places[k];
            if (is_knot && k > 0u && i < LAST_ITERATIONS) {
                places[k] = here + outward_push(here, guide.xyz - shape, rest, knot.clearance);
            }
            workgroupBarrier();
        }
        knot.position = places[k];
    }
    if (is_knot) {
        knot.shape = guide.xyz;
        store(first + k, knot, guide, outward);
    }
}
