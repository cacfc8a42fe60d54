// Rasterises triangles in compute: the nearest depth of each pixel, then which triangle it belongs to.
// One workgroup takes one triangle of one layer; its invocations share the pixels of the bounding box.
//#include "geometry.wgsl"
//#include "views.wgsl"

override FIND_TRIANGLE: bool = false; // false: write depths; true: write indices where the depth is theirs

const LANES: u32 = 64u;
const SLACK: f32 = 1e-5; // covers rounding, so that no pixel falls between two triangles
const GROUPS_PER_ROW: u32 = 32768u;

@group(1) @binding(1) var<storage, read_write> nearness: array<atomic<u32>>; // bits of the depth: 1 near, 0 empty
@group(1) @binding(2) var<storage, read_write> found: array<u32>; // triangle + 1

struct Corner2 {
    place: vec2f, // [pixel]
    nearness: f32,
    behind: bool,
}

fn project(vertex: u32, layer: u32) -> Corner2 {
    let clip = views.clip[layer] * vec4f(position_of(vertex), 1.0);
    let size = vec2f(f32(views.width), f32(views.height));
    let ndc = clip.xyz / clip.w;
    return Corner2((vec2f(0.5, -0.5) * ndc.xy + 0.5) * size, ndc.z, clip.w <= 0.0);
}

fn cross2(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = group.y * GROUPS_PER_ROW + group.x;
    if (index >= views.triangles) {
        return;
    }
    let t = triangle_at(index);
    let a = project(t.x, group.z);
    let b = project(t.y, group.z);
    let c = project(t.z, group.z);
    let area = cross2(b.place - a.place, c.place - a.place);
    if (a.behind || b.behind || c.behind || area == 0.0) {
        return;
    }
    // Pixels whose centre lies in the bounding box.
    let last = vec2f(f32(views.width), f32(views.height)) - 1.0;
    let low = clamp(ceil(min(min(a.place, b.place), c.place) - 0.5), vec2f(0.0), last + 1.0);
    let high = clamp(floor(max(max(a.place, b.place), c.place) - 0.5), vec2f(-1.0), last);
    let box = vec2u(max(high - low + 1.0, vec2f(0.0)));
    for (var i = lane; i < box.x * box.y; i += LANES) {
        let pixel = vec2u(low) + vec2u(i % box.x, i / box.x);
        let p = vec2f(pixel) + 0.5;
        let w = vec3f(
            cross2(c.place - b.place, p - b.place),
            cross2(a.place - c.place, p - c.place),
            cross2(b.place - a.place, p - a.place),
        ) / area;
        let near = dot(w, vec3f(a.nearness, b.nearness, c.nearness));
        if (all(w >= vec3f(-SLACK)) && near > 0.0 && near <= 1.0) {
            record(index, (group.z * views.height + pixel.y) * views.pitch + pixel.x, bitcast<u32>(near));
        }
    }
}

fn record(index: u32, at: u32, near: u32) {
    if (!FIND_TRIANGLE) {
        atomicMax(&nearness[at], near); // positive floats sort like their bits
    } else if (atomicLoad(&nearness[at]) == near) {
        found[at] = index + 1u;
    }
}
