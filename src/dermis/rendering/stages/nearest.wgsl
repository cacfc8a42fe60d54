// Rasterises triangles in compute: the nearest depth of each pixel, then which triangle it belongs to.
// One workgroup takes some triangles of one view: each is set up by one invocation and drawn by teams of them, which take
// turns at its rows of squares, one pixel an invocation.
//#include "geometry.wgsl"
//#include "views.wgsl"

override FIND_TRIANGLE: bool = false; // false: write depths; true: write indices where the depth is theirs
override SAMPLES: u32 = 1u; // places in a pixel at which each view is seen, a layer each

const TAKEN: u32 = 4u; // triangles of a workgroup
const TEAMS: u32 = 4u;
const SIDE: u32 = 8u; // of the square that a team covers
const EXTENT: f32 = 7.0; // from the first to the last pixel of its side
const ROUNDING: u32 = 4u; // the two passes may round differently
const SLACK: f32 = 1e-5; // covers rounding, so that no pixel falls between two triangles

@group(1) @binding(1) var<storage, read_write> nearness: array<atomic<u32>>; // bits of the depth, 0 empty
@group(1) @binding(2) var<storage, read_write> found: array<atomic<u32>>; // triangle + 1

// Corner in homogeneous pixels: place times w, w; and its clip depth.
struct Projected {
    place: vec3f,
    z: f32,
}

struct Box {
    low: vec2f,
    size: vec2u,
}

// A triangle to draw: its barycentric weights and its depth, linear in the place within its box.
struct Drawn {
    box: Box,
    along_x: vec4f, // of a, b, c and the depth, per pixel
    along_y: vec4f,
    at_low: vec4f, // at the corner of the box's first pixel
    most: vec3f, // that the weights grow within a square
}

var<workgroup> taken: array<Drawn, TAKEN>;

fn project(vertex: u32, view: u32) -> Projected {
    let clip = views.clip[view] * vec4f(position_of(vertex), 1.0);
    let size = vec2f(f32(views.width), f32(views.height));
    return Projected(vec3f((vec2f(0.5, -0.5) * clip.xy + 0.5 * clip.w) * size, clip.w), clip.z);
}

// Pixels whose samples may lie in the triangle: all of them where it reaches behind the eye.
fn bounds(a: vec3f, b: vec3f, c: vec3f) -> Box {
    let last = vec2f(f32(views.width), f32(views.height)) - 1.0;
    if (min(min(a.z, b.z), c.z) <= 0.0) {
        return Box(vec2f(0.0), vec2u(last) + 1u);
    }
    let pa = a.xy / a.z;
    let pb = b.xy / b.z;
    let pc = c.xy / c.z;
    let low = clamp(ceil(min(min(pa, pb), pc) - views.reach.zw), vec2f(0.0), last + 1.0);
    let high = clamp(floor(max(max(pa, pb), pc) - views.reach.xy), vec2f(-1.0), last);
    return Box(low, vec2u(max(high - low + 1.0, vec2f(0.0))));
}

// Seen from the box's corner, for precision: weights that combine the corners into a pixel, linear in it
// [OlanoGreer1997]. Each times its corner's distance they are all positive inside.
fn set_up(index: u32, view: u32) -> Drawn {
    let t = triangle_at(index);
    let a = project(t.x, view);
    let b = project(t.y, view);
    let c = project(t.z, view);
    let w = vec3f(a.place.z, b.place.z, c.place.z);
    let box = bounds(a.place, b.place, c.place);
    let pa = a.place - vec3f(box.low * w.x, 0.0);
    let pb = b.place - vec3f(box.low * w.y, 0.0);
    let pc = c.place - vec3f(box.low * w.z, 0.0);
    let volume = dot(pa, cross(pb, pc));
    if (volume == 0.0) {
        return Drawn(Box(vec2f(0.0), vec2u(0u)), vec4f(0.0), vec4f(0.0), vec4f(0.0), vec3f(0.0));
    }
    let weights = transpose(mat3x3f(cross(pb, pc) / volume, cross(pc, pa) / volume, cross(pa, pb) / volume));
    let z = vec3f(a.z, b.z, c.z);
    let x = weights[0] * abs(w);
    let y = weights[1] * abs(w);
    let low = weights[2] * abs(w);
    let most = max(x * views.reach.x, x * (views.reach.z + EXTENT)) + max(y * views.reach.y, y * (views.reach.w + EXTENT));
    return Drawn(
        box,
        vec4f(x, dot(weights[0], z)),
        vec4f(y, dot(weights[1], z)),
        vec4f(low, dot(weights[2], z)),
        most + SLACK,
    );
}

@compute @workgroup_size(SIDE, SIDE, TEAMS)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_id) lane: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    // Triangles far from each other in the list: neighbours are often all large, and one workgroup would have them all.
    let first = group.y * groups.x + group.x;
    let step = groups.x * groups.y;
    let index = first + number * step;
    if (number < TAKEN && index < views.triangles) {
        taken[number] = set_up(index, group.z);
    }
    workgroupBarrier();
    for (var k = 0u; k < TAKEN; k++) {
        if (first + k * step < views.triangles) {
            draw(first + k * step, taken[k], lane.xy, (lane.z + k) % TEAMS, group.z);
        }
    }
}

// turn: of the team, so that small triangles keep all of them busy
fn draw(index: u32, triangle: Drawn, lane: vec2u, turn: u32, view: u32) {
    let within = f32(lane.x) * triangle.along_x + f32(lane.y) * triangle.along_y;
    for (var y = turn * SIDE; y < triangle.box.size.y; y += TEAMS * SIDE) {
        for (var x = 0u; x < triangle.box.size.x; x += SIDE) {
            let here = triangle.at_low + f32(x) * triangle.along_x + f32(y) * triangle.along_y;
            let best = here.xyz + triangle.most;
            if (min(min(best.x, best.y), best.z) >= 0.0) {
                draw_samples(index, triangle, here + within, vec2u(x, y) + lane, view);
            }
        }
    }
}

// here: weights and depth at the pixel's corner
fn draw_samples(index: u32, triangle: Drawn, here: vec4f, at: vec2u, view: u32) {
    if (any(at >= triangle.box.size)) {
        return;
    }
    let pixel = vec2u(triangle.box.low) + at;
    for (var s = 0u; s < SAMPLES; s++) {
        let place = views.sample[s].xy;
        let part = here + place.x * triangle.along_x + place.y * triangle.along_y;
        if (min(min(part.x, part.y), part.z) >= -SLACK && part.w > 0.0 && part.w <= 1.0) {
            let layer = view * SAMPLES + s;
            record(index, (layer * views.height + pixel.y) * views.width + pixel.x, bitcast<u32>(part.w));
        }
    }
}

fn record(index: u32, at: u32, near: u32) {
    if (!FIND_TRIANGLE) {
        atomicMax(&nearness[at], near); // positive floats sort like their bits
    } else if (near + ROUNDING >= atomicLoad(&nearness[at])) {
        atomicMax(&found[at], index + 1u); // of two triangles at one depth the later one, always
    }
}
