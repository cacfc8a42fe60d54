// For each texel of an occlusion map, the surrounding vertices and their barycentric weights.
//#include "shape/geometry.wgsl"

const NO_VERTEX: u32 = 0xffffffffu;

@group(0) @binding(31) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(0) @binding(32) var corners: texture_storage_2d<rgba32uint, write>; // one texel for each atlas texel of the map

// Texel of the atlas at a texel of the map.
fn atlas_texel(position: vec2u) -> vec2u {
    let at = (vec2f(position) + 0.5) * vec2f(textureDimensions(atlas)) / vec2f(textureDimensions(corners));
    return textureLoad(atlas, vec2u(at), 0).xy;
}

// Beside the edge of a chart, where filters still read, a texel takes the position of a neighbour.
fn nearby_texel(position: vec2u) -> vec2u {
    let own = atlas_texel(position);
    if (own.x > 0u) {
        return own;
    }
    for (var k = 0u; k < 9u; k++) {
        let neighbour = max(position + vec2u(k % 3u, k / 3u), vec2u(1u)) - 1u;
        let texel = atlas_texel(min(neighbour, textureDimensions(corners) - 1u));
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
    let texel = nearby_texel(id.xy);
    var result = vec4u(NO_VERTEX);
    if (texel.x > 0u) {
        result = vec4u(triangle_at(texel.x - 1u).xyz, texel.y);
    }
    textureStore(corners, id.xy, result);
}
