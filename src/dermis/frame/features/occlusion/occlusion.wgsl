// Sky visibility at texels of the atlas and at vertices: sums of the cosines of the directions from which a point is visible,
// and of all directions.
//#include "shape/geometry.wgsl"
//#include "surface/skin.wgsl"
//#include "lights.wgsl"

struct Sky {
    directions: u32, // number of directions of this pass, as parallel lights
    side: u32, // texels along a side of the atlas; the vertices follow
    vertices: u32,
}

@group(0) @binding(30) var<uniform> sky: Sky;
@group(0) @binding(31) var atlas: texture_2d<u32>;
@group(0) @binding(32) var<storage, read_write> sums: array<vec2f>; // sums over all passes so far

fn texel_point(position: vec2u) -> Point {
    let at = vec2u((vec2f(position) + 0.5) * vec2f(textureDimensions(atlas)) / f32(sky.side));
    let texel = textureLoad(atlas, at, 0);
    if (texel.x == 0u) {
        return Point();
    }
    let t = triangle_at(texel.x - 1u);
    let w = unpack2x16unorm(texel.y);
    return interpolate(corner_at(t.x), corner_at(t.y), corner_at(t.z), vec3f(1.0 - w.x - w.y, w), t.w);
}

fn vertex_point(index: u32) -> Point {
    let corner = corner_at(index);
    return interpolate(corner, corner, corner, vec3f(1.0, 0.0, 0.0), 0u);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * sky.side + id.x;
    let texels = sky.side * sky.side;
    if (id.x >= sky.side || index >= texels + sky.vertices) {
        return;
    }
    var point: Point;
    if (index < texels) {
        point = texel_point(id.xy);
    } else {
        point = vertex_point(index - texels);
    }
    var sum = vec2f(0.0);
    for (var i = 0u; i < sky.directions; i++) {
        let light = lights.light[i];
        let cosine = dot(point.normal, -light.direction);
        if (cosine > 0.0) {
            sum += cosine * vec2f(visibility(light, point, -light.direction), 1.0);
        }
    }
    sums[index] += sum;
}
