// The surface at texels of the atlas, and at those beside each on the surface.
//#include "packed_surface.wgsl"
//#include "oblique.wgsl"

@group(0) @binding(30) var surfaces: texture_2d_array<u32>; // as surface_texels.wgsl packs them

const APART: i32 = 2; // texels by which the surface is told to bend

fn packed_at(at: vec2i) -> Packed {
    return Packed(textureLoad(surfaces, at, 0, 0), textureLoad(surfaces, at, 1, 0));
}

// A texel along an axis, the nearer one of both sides; the texel itself where neither shows surface.
fn texel_beside(at: vec2i, position: vec3f, axis: vec2i) -> vec2i {
    let last = vec2i(textureDimensions(surfaces)) - 1;
    var found = at;
    var least = 0.0;
    for (var side = -1; side <= 1; side += 2) {
        let other = at + side * axis;
        let within = clamp(other, vec2i(0), last);
        let way = bitcast<vec3f>(textureLoad(surfaces, within, 0, 0).xyz) - position;
        let square = dot(way, way);
        let shown = textureLoad(surfaces, within, 1, 0).w != 0u && all(other == within);
        if (shown && (least == 0.0 || square < least)) {
            found = within;
            least = square;
        }
    }
    return found;
}

// mm from a texel to the next along an axis; 0 where it shows no surface.
fn texel_step(at: vec2i, position: vec3f, axis: vec2i) -> vec3f {
    return bitcast<vec3f>(textureLoad(surfaces, texel_beside(at, position, axis), 0, 0).xyz) - position;
}

// How the surface goes on beside a texel.
fn beside_texel(at: vec2i, point: Point) -> GoesOn {
    let u = textureLoad(surfaces, texel_beside(at, point.position, vec2i(APART, 0)), 0, 0);
    let v = textureLoad(surfaces, texel_beside(at, point.position, vec2i(0, APART)), 0, 0);
    return GoesOn(
        bitcast<vec3f>(u.xyz) - point.position,
        bitcast<vec3f>(v.xyz) - point.position,
        unpack_direction(u.w) - point.normal,
        unpack_direction(v.w) - point.normal,
    );
}
