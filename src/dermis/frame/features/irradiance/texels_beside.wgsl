// Surface at a texel of the atlas and at its neighbours.
//#include "surface/packed_surface.wgsl"
//#include "oblique.wgsl"

@group(0) @binding(30) var surfaces: texture_2d_array<u32>; // packed by surface_texels.wgsl

const BEND_STEP: i32 = 2; // distance over which the bend of the surface is measured [texels]

fn packed_at(at: vec2i) -> Packed {
    return Packed(textureLoad(surfaces, at, 0, 0), textureLoad(surfaces, at, 1, 0));
}

// `Packed.geometry` of a neighbour along an axis, the nearer one of both; that of the texel itself without neighbours.
fn neighbour_on_surface(at: vec2i, own: vec4u, axis: vec2i) -> vec4u {
    let position = bitcast<vec3f>(own.xyz);
    let last = vec2i(textureDimensions(surfaces)) - 1;
    var found = own;
    var least = 0.0;
    for (var side = -1; side <= 1; side += 2) {
        let other = at + side * axis;
        let within = clamp(other, vec2i(0), last);
        let geometry = textureLoad(surfaces, within, 0, 0);
        let offset = bitcast<vec3f>(geometry.xyz) - position;
        let square = dot(offset, offset);
        let is_surface = any(geometry != vec4u(0u)) && all(other == within); // no surface is all zeros
        if (is_surface && (least == 0.0 || square < least)) {
            found = geometry;
            least = square;
        }
    }
    return found;
}

// Vector from a texel to its neighbour along an axis [mm]; 0 without a neighbour.
fn texel_step(at: vec2i, own: vec4u, axis: vec2i) -> vec3f {
    return bitcast<vec3f>(neighbour_on_surface(at, own, axis).xyz) - bitcast<vec3f>(own.xyz);
}

const MIN_SQUARED_SINE: f32 = 1e-4; // between the directions to two neighbours

// Bend of the surface at a texel, 0 at its border.
fn bend_at(at: vec2i, own: vec4u) -> Bend {
    let u = neighbour_on_surface(at, own, vec2i(BEND_STEP, 0));
    let v = neighbour_on_surface(at, own, vec2i(0, BEND_STEP));
    let normal = unpack_direction(own.w);
    let position = bitcast<vec3f>(own.xyz);
    let offset_u = bitcast<vec3f>(u.xyz) - position;
    let offset_v = bitcast<vec3f>(v.xyz) - position;
    let flat = offset_u - dot(offset_u, normal) * normal;
    let along = flat / max(length(flat), 1e-9);
    let across = cross(normal, along);
    let offsets = mat2x2f(dot(offset_u, along), dot(offset_u, across), dot(offset_v, along), dot(offset_v, across));
    let det = determinant(offsets);
    if (det * det <= MIN_SQUARED_SINE * dot(offset_u, offset_u) * dot(offset_v, offset_v)) {
        return Bend(along, vec3f(0.0));
    }
    let turn_u = unpack_direction(u.w) - normal;
    let turn_v = unpack_direction(v.w) - normal;
    let turns = mat2x2f(dot(turn_u, along), dot(turn_u, across), dot(turn_v, along), dot(turn_v, across));
    let inverse = mat2x2f(offsets[1][1], -offsets[0][1], -offsets[1][0], offsets[0][0]) * (1.0 / det);
    let bend = turns * inverse;
    return Bend(along, vec3f(bend[0][0], 0.5 * (bend[0][1] + bend[1][0]), bend[1][1]));
}
