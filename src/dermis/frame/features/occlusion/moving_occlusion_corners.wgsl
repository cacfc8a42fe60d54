// The three vertices between which each texel of an occlusion map lies, and their weights.
//#include "shape/geometry.wgsl"

const NONE: u32 = 0xffffffffu;

@group(0) @binding(31) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(0) @binding(32) var corners: texture_storage_2d<rgba32uint, write>; // as large as the map's part for the atlas

// The atlas' texel of a place of the map.
fn texel_of(place: vec2u) -> vec2u {
    let at = (vec2f(place) + 0.5) * vec2f(textureDimensions(atlas)) / vec2f(textureDimensions(corners));
    return textureLoad(atlas, vec2u(at), 0).xy;
}

// Next to a chart's edge, where filters still read, a texel lies where its neighbour does.
fn texel_near(place: vec2u) -> vec2u {
    let own = texel_of(place);
    if (own.x > 0u) {
        return own;
    }
    for (var k = 0u; k < 9u; k++) {
        let beside = max(place + vec2u(k % 3u, k / 3u), vec2u(1u)) - 1u;
        let texel = texel_of(min(beside, textureDimensions(corners) - 1u));
        if (texel.x > 0u) {
            return texel;
        }
    }
    return own;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(corners))) {
        return;
    }
    let texel = texel_near(id.xy);
    var made = vec4u(NONE);
    if (texel.x > 0u) {
        made = vec4u(triangle_at(texel.x - 1u).xyz, texel.y);
    }
    textureStore(corners, id.xy, made);
}
