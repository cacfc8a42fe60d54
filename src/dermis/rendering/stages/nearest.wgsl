// Rasterises triangles in compute: the nearest depth of each pixel, then which triangle it belongs to.
// One workgroup takes one triangle of one layer; its invocations share the pixels of the bounding box.
//#include "geometry.wgsl"
//#include "views.wgsl"

override FIND_TRIANGLE: bool = false; // false: write depths; true: write indices where the depth is theirs

const ROUNDING: u32 = 4u; // the two passes may round differently
const LANES: u32 = 64u;
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

fn project(vertex: u32, layer: u32) -> Projected {
    let clip = views.clip[layer] * vec4f(position_of(vertex), 1.0);
    let size = vec2f(f32(views.width), f32(views.height));
    return Projected(vec3f((vec2f(0.5, -0.5) * clip.xy + 0.5 * clip.w) * size, clip.w), clip.z);
}

// Pixels whose centre may lie in the triangle: all of them where it reaches behind the eye.
fn bounds(a: vec3f, b: vec3f, c: vec3f) -> Box {
    let last = vec2f(f32(views.width), f32(views.height)) - 1.0;
    if (min(min(a.z, b.z), c.z) <= 0.0) {
        return Box(vec2f(0.0), vec2u(last) + 1u);
    }
    let pa = a.xy / a.z;
    let pb = b.xy / b.z;
    let pc = c.xy / c.z;
    let low = clamp(ceil(min(min(pa, pb), pc) - 0.5), vec2f(0.0), last + 1.0);
    let high = clamp(floor(max(max(pa, pb), pc) - 0.5), vec2f(-1.0), last);
    return Box(low, vec2u(max(high - low + 1.0, vec2f(0.0))));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = group.y * groups.x + group.x;
    if (index >= views.triangles) {
        return;
    }
    let t = triangle_at(index);
    let a = project(t.x, group.z);
    let b = project(t.y, group.z);
    let c = project(t.z, group.z);
    let w = vec3f(a.place.z, b.place.z, c.place.z);
    let box = bounds(a.place, b.place, c.place);
    // Seen from the box's corner, for precision: weights that combine the corners into a pixel, linear in it
    // [OlanoGreer1997].
    let pa = a.place - vec3f(box.low * w.x, 0.0);
    let pb = b.place - vec3f(box.low * w.y, 0.0);
    let pc = c.place - vec3f(box.low * w.z, 0.0);
    let weights = transpose(mat3x3f(cross(pb, pc), cross(pc, pa), cross(pa, pb)));
    let volume = dot(pa, cross(pb, pc));
    if (volume == 0.0) {
        return;
    }
    for (var i = lane; i < box.size.x * box.size.y; i += LANES) {
        let pixel = vec2u(i % box.size.x, i / box.size.x);
        let part = weights * vec3f(vec2f(pixel) + 0.5, 1.0) / volume;
        let near = dot(part, vec3f(a.z, b.z, c.z));
        if (all(part * abs(w) >= vec3f(-SLACK)) && near > 0.0 && near <= 1.0) {
            let place = vec2u(box.low) + pixel;
            record(index, (group.z * views.height + place.y) * views.pitch + place.x, bitcast<u32>(near));
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
