// Setup of triangles in a view: barycentric weights and depth as linear functions of the pixel position, and the blocks of
// pixels that a triangle may cover.
//#include "shape/geometry.wgsl"
//#include "views.wgsl"
//#include "cutouts.wgsl"

override SAMPLES: u32 = 1u; // samples of a pixel, a layer for each
override BLOCK: u32 = select(8u, 4u, SAMPLES > 1u); // pixels along a side of a block

const SLACK: f32 = 1e-5; // tolerance for rounding, so that no pixel falls between two triangles
const MIN_DISTANCE_RATIO: f32 = 0.1; // lower bound of the distance of a corner, relative to the largest one, so that the tolerance stays small close to the eye

// Corner in homogeneous pixels: (x w, y w, w), and its clip depth.
struct ClipCorner {
    position: vec3f,
    z: f32,
}

// A box of pixels.
struct Box {
    low: vec2u,
    size: vec2u,
}

// A triangle in its box: barycentric weights and depth are linear in the position.
struct ProjectedTriangle {
    box: Box,
    along_x: vec4f, // change of the weights of a, b, c and of the depth per pixel
    along_y: vec4f,
    at_low: vec4f, // at the corner of the first pixel of the box
    //#if CUTOUTS
    weight_scale: vec3f, // factor of the weights, which makes their sum the inverse distance
    //#end
}

fn project(vertex: u32, view: u32) -> ClipCorner {
    let clip = views.clip[view] * vec4f(position_of(vertex), 1.0);
    let size = vec2f(f32(views.width), f32(views.height));
    return ClipCorner(vec3f((vec2f(0.5, -0.5) * clip.xy + 0.5 * clip.w) * size, clip.w), clip.z);
}

// Pixels whose samples may lie in a triangle; all pixels if it extends behind the eye.
fn bounds(a: vec3f, b: vec3f, c: vec3f) -> Box {
    let last = vec2f(f32(views.width), f32(views.height)) - 1.0;
    if (min(min(a.z, b.z), c.z) <= 0.0) {
        return Box(vec2u(0u), vec2u(last) + 1u);
    }
    let pa = a.xy / a.z;
    let pb = b.xy / b.z;
    let pc = c.xy / c.z;
    let low = clamp(ceil(min(min(pa, pb), pc) - views.sample_bounds.zw), vec2f(0.0), last + 1.0);
    let high = clamp(floor(max(max(pa, pb), pc) - views.sample_bounds.xy), vec2f(-1.0), last);
    return Box(vec2u(low), vec2u(max(high - low + 1.0, vec2f(0.0))));
}

// Weights that are linear in the pixel [OlanoGreer1997], relative to the corner of the box for precision. Times the distances
// of their corners they are positive inside the triangle.
fn setup_triangle(index: u32, view: u32) -> ProjectedTriangle {
    let t = triangle_at(index);
    let a = project(t.x, view);
    let b = project(t.y, view);
    let c = project(t.z, view);
    let w = vec3f(a.position.z, b.position.z, c.position.z);
    let box = bounds(a.position, b.position, c.position);
    let low = vec2f(box.low);
    let pa = a.position - vec3f(low * w.x, 0.0);
    let pb = b.position - vec3f(low * w.y, 0.0);
    let pc = c.position - vec3f(low * w.z, 0.0);
    let volume = dot(pa, cross(pb, pc));
    if (volume == 0.0) {
        var none: ProjectedTriangle;
        return none;
    }
    let weights = transpose(mat3x3f(cross(pb, pc) / volume, cross(pc, pa) / volume, cross(pa, pb) / volume));
    let z = vec3f(a.z, b.z, c.z);
    let distances = abs(w);
    let scale = max(distances, vec3f(MIN_DISTANCE_RATIO * max(max(distances.x, distances.y), distances.z)));
    var projected: ProjectedTriangle;
    projected.box = box;
    projected.along_x = vec4f(weights[0] * scale, dot(weights[0], z));
    projected.along_y = vec4f(weights[1] * scale, dot(weights[1], z));
    projected.at_low = vec4f(weights[2] * scale, dot(weights[2], z));
    //#if CUTOUTS
    projected.weight_scale = 1.0 / scale;
    //#end
    return projected;
}

fn first_block(box: Box) -> vec2u {
    return box.low / BLOCK;
}

// Number of blocks across and down.
fn block_counts(box: Box) -> vec2u {
    return (box.low + box.size - 1u) / BLOCK - first_block(box) + 1u;
}

// Largest increase of the weights within a block.
fn block_margin(triangle: ProjectedTriangle) -> vec3f {
    let x = triangle.along_x.xyz;
    let y = triangle.along_y.xyz;
    let far = views.sample_bounds.zw + f32(BLOCK - 1u);
    return max(x * views.sample_bounds.x, x * far.x) + max(y * views.sample_bounds.y, y * far.y) + SLACK;
}

// Whether a sample of a block may lie inside: no weight is negative in the whole block.
fn may_cover(triangle: ProjectedTriangle, margin: vec3f, block: vec2u) -> bool {
    let at = vec2f(vec2i(block * BLOCK) - vec2i(triangle.box.low));
    let highest = triangle.at_low.xyz + at.x * triangle.along_x.xyz + at.y * triangle.along_y.xyz + margin;
    return min(min(highest.x, highest.y), highest.z) >= 0.0;
}
