// Surface properties at a texel of the atlas, packed into 32 bytes for the lighting passes.
//#include "shape/geometry.wgsl"
//#include "skin.wgsl"

const MIN_EXPONENT: f32 = 32.0; // of colours
const MAX_HALF: f32 = 65504.0;

struct Packed {
    geometry: vec4u, // position, interpolated normal
    appearance: vec4u, // normal with relief; colour, and height over the facet; roughness and rho_s, 0 without surface
}

// Octahedral encoding of unit vectors. Source: [Cigolle2014].
fn pack_direction(d: vec3f) -> u32 {
    let on = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    let folded = (1.0 - abs(on.yx)) * select(vec2f(-1.0), vec2f(1.0), on >= vec2f(0.0));
    return pack2x16snorm(select(on, folded, d.z < 0.0));
}

fn unpack_direction(word: u32) -> vec3f {
    let on = unpack2x16snorm(word);
    let z = 1.0 - abs(on.x) - abs(on.y);
    let folded = (1.0 - abs(on.yx)) * select(vec2f(-1.0), vec2f(1.0), on >= vec2f(0.0));
    return normalize(vec3f(select(on, folded, z < 0.0), z));
}

// Three mantissas of 16 bits with a shared exponent of 6; the height is a half float without sign and last five bits.
fn pack_colour(colour: vec3f, height: f32) -> vec2u {
    let largest = max(max(colour.r, colour.g), max(colour.b, 1e-9));
    let exponent = clamp(ceil(log2(largest)), -MIN_EXPONENT, MIN_EXPONENT - 1.0);
    let parts = vec3u(round(65535.0 * saturate(colour * exp2(-exponent))));
    let above = (pack2x16float(vec2f(height, 0.0)) >> 5u) & 1023u;
    return vec2u(parts.r | (parts.g << 16u), parts.b | (u32(exponent + MIN_EXPONENT) << 16u) | (above << 22u));
}

fn pack_surface(point: Point, surface: Surface) -> Packed {
    let height = clamp(dot(point.lit_position - point.position, point.normal), 0.0, MAX_HALF);
    let colour = pack_colour(surface.colour, height);
    let gloss = pack2x16float(vec2f(surface.roughness, surface.rho_s));
    return Packed(
        vec4u(bitcast<vec3u>(point.position), pack_direction(point.normal)),
        vec4u(pack_direction(surface.normal), colour, gloss),
    );
}

// A point without the members that only the shading of the picture needs.
fn unpack_point(packed: Packed) -> Point {
    var point: Point;
    point.position = bitcast<vec3f>(packed.geometry.xyz);
    point.normal = unpack_direction(packed.geometry.w);
    point.lit_position = point.position + unpack2x16float((packed.appearance.z >> 22u) << 5u).x * point.normal;
    point.flags = MAPPED;
    return point;
}

fn unpack_surface(packed: Packed) -> Surface {
    let words = packed.appearance.yz;
    let parts = vec3f(vec3u(words.x & 0xffffu, words.x >> 16u, words.y & 0xffffu));
    let scale = exp2(f32((words.y >> 16u) & 63u) - MIN_EXPONENT) / 65535.0;
    let gloss = unpack2x16float(packed.appearance.w);
    return Surface(unpack_direction(packed.appearance.x), scale * parts, gloss.x, gloss.y);
}
