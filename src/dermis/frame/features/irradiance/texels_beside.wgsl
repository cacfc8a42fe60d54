// The surface at texels of the atlas, and at those beside each on the surface.
//#include "surface/packed_surface.wgsl"
//#include "oblique.wgsl"

@group(0) @binding(30) var surfaces: texture_2d_array<u32>; // as surface_texels.wgsl packs them

const APART: i32 = 2; // texels by which the surface is told to bend

fn packed_at(at: vec2i) -> Packed {
    return Packed(textureLoad(surfaces, at, 0, 0), textureLoad(surfaces, at, 1, 0));
}

// `place` of the texel beside one along an axis, the nearer one of both sides; its own where neither shows surface.
fn place_beside(at: vec2i, own: vec4u, axis: vec2i) -> vec4u {
    let position = bitcast<vec3f>(own.xyz);
    let last = vec2i(textureDimensions(surfaces)) - 1;
    var found = own;
    var least = 0.0;
    for (var side = -1; side <= 1; side += 2) {
        let other = at + side * axis;
        let within = clamp(other, vec2i(0), last);
        let place = textureLoad(surfaces, within, 0, 0);
        let way = bitcast<vec3f>(place.xyz) - position;
        let square = dot(way, way);
        let shown = any(place != vec4u(0u)) && all(other == within); // no surface is all zeros
        if (shown && (least == 0.0 || square < least)) {
            found = place;
            least = square;
        }
    }
    return found;
}

// mm from a texel to the next along an axis; 0 where it shows no surface.
fn texel_step(at: vec2i, own: vec4u, axis: vec2i) -> vec3f {
    return bitcast<vec3f>(place_beside(at, own, axis).xyz) - bitcast<vec3f>(own.xyz);
}

const LEAST_APART: f32 = 1e-4; // of the square of the sine between two ways

// How the surface bends at a texel; not at all where it ends.
fn bend_at(at: vec2i, own: vec4u) -> Bend {
    let u = place_beside(at, own, vec2i(APART, 0));
    let v = place_beside(at, own, vec2i(0, APART));
    let normal = unpack_direction(own.w);
    let position = bitcast<vec3f>(own.xyz);
    let way_u = bitcast<vec3f>(u.xyz) - position;
    let way_v = bitcast<vec3f>(v.xyz) - position;
    let flat = way_u - dot(way_u, normal) * normal;
    let along = flat / max(length(flat), 1e-9);
    let across = cross(normal, along);
    let ways = mat2x2f(dot(way_u, along), dot(way_u, across), dot(way_v, along), dot(way_v, across));
    let apart = determinant(ways);
    if (apart * apart <= LEAST_APART * dot(way_u, way_u) * dot(way_v, way_v)) {
        return Bend(along, vec3f(0.0));
    }
    let turn_u = unpack_direction(u.w) - normal;
    let turn_v = unpack_direction(v.w) - normal;
    let turns = mat2x2f(dot(turn_u, along), dot(turn_u, across), dot(turn_v, along), dot(turn_v, across));
    let inverse = mat2x2f(ways[1][1], -ways[0][1], -ways[1][0], ways[0][0]) * (1.0 / apart);
    let bend = turns * inverse;
    return Bend(along, vec3f(bend[0][0], 0.5 * (bend[0][1] + bend[1][0]), bend[1][1]));
}
