// Triangles projected into a view: planes over its pixels, and the blocks of pixels that they may cover.
//#include "shape/geometry.wgsl"
//#include "views.wgsl"

override SAMPLES: u32 = 1u; // samples of each view in a pixel, a layer each
override BLOCK: u32 = select(8u, 4u, SAMPLES > 1u); // pixels along a side of a block

const SLACK: f32 = 1e-5; // covers rounding, so that no pixel falls between two triangles
const LEAST: f32 = 0.1; // least distance over the greatest: with less, beside the eye, slack would reach far beyond an edge

// Corner in homogeneous pixels: place times w, w; and its clip depth.
struct Projected {
    place: vec3f,
    z: f32,
}

// A box of pixels.
struct Box {
    low: vec2u,
    size: vec2u,
}

// A triangle to draw: its barycentric weights and its depth, linear in the place within its box.
struct Drawn {
    box: Box,
    along_x: vec4f, // of a, b, c and the depth, per pixel
    along_y: vec4f,
    at_low: vec4f, // at the corner of the box's first pixel
}

fn project(vertex: u32, view: u32) -> Projected {
    let clip = views.clip[view] * vec4f(position_of(vertex), 1.0);
    let size = vec2f(f32(views.width), f32(views.height));
    return Projected(vec3f((vec2f(0.5, -0.5) * clip.xy + 0.5 * clip.w) * size, clip.w), clip.z);
}

// Pixels whose samples may lie in the triangle: all of them where it reaches behind the eye.
fn bounds(a: vec3f, b: vec3f, c: vec3f) -> Box {
    let last = vec2f(f32(views.width), f32(views.height)) - 1.0;
    if (min(min(a.z, b.z), c.z) <= 0.0) {
        return Box(vec2u(0u), vec2u(last) + 1u);
    }
    let pa = a.xy / a.z;
    let pb = b.xy / b.z;
    let pc = c.xy / c.z;
    let low = clamp(ceil(min(min(pa, pb), pc) - views.reach.zw), vec2f(0.0), last + 1.0);
    let high = clamp(floor(max(max(pa, pb), pc) - views.reach.xy), vec2f(-1.0), last);
    return Box(vec2u(low), vec2u(max(high - low + 1.0, vec2f(0.0))));
}

// Relative to the box's corner, for precision: weights that combine the corners into a pixel, linear in it
// [OlanoGreer1997]. Multiplied by the distances of their corners they are all positive inside.
fn set_up(index: u32, view: u32) -> Drawn {
    let t = triangle_at(index);
    let a = project(t.x, view);
    let b = project(t.y, view);
    let c = project(t.z, view);
    let w = vec3f(a.place.z, b.place.z, c.place.z);
    let box = bounds(a.place, b.place, c.place);
    let low = vec2f(box.low);
    let pa = a.place - vec3f(low * w.x, 0.0);
    let pb = b.place - vec3f(low * w.y, 0.0);
    let pc = c.place - vec3f(low * w.z, 0.0);
    let volume = dot(pa, cross(pb, pc));
    if (volume == 0.0) {
        return Drawn(Box(vec2u(0u), vec2u(0u)), vec4f(0.0), vec4f(0.0), vec4f(0.0));
    }
    let weights = transpose(mat3x3f(cross(pb, pc) / volume, cross(pc, pa) / volume, cross(pa, pb) / volume));
    let z = vec3f(a.z, b.z, c.z);
    let away = abs(w);
    let scale = max(away, vec3f(LEAST * max(max(away.x, away.y), away.z)));
    return Drawn(
        box,
        vec4f(weights[0] * scale, dot(weights[0], z)),
        vec4f(weights[1] * scale, dot(weights[1], z)),
        vec4f(weights[2] * scale, dot(weights[2], z)),
    );
}

fn first_block(box: Box) -> vec2u {
    return box.low / BLOCK;
}

// Number of blocks across and down.
fn blocks_of(box: Box) -> vec2u {
    return (box.low + box.size - 1u) / BLOCK - first_block(box) + 1u;
}

// The most that the weights grow within a block.
fn most_within_block(triangle: Drawn) -> vec3f {
    let x = triangle.along_x.xyz;
    let y = triangle.along_y.xyz;
    let far = views.reach.zw + f32(BLOCK - 1u);
    return max(x * views.reach.x, x * far.x) + max(y * views.reach.y, y * far.y) + SLACK;
}

// Whether some sample of a block may lie inside: no weight is negative throughout the block.
fn may_cover(triangle: Drawn, most: vec3f, block: vec2u) -> bool {
    let at = vec2f(vec2i(block * BLOCK) - vec2i(triangle.box.low));
    let best = triangle.at_low.xyz + at.x * triangle.along_x.xyz + at.y * triangle.along_y.xyz + most;
    return min(min(best.x, best.y), best.z) >= 0.0;
}
