// Map at half the resolution: each texel is the mean over its area, which spans up to three finer texels if the finer size is
// odd.
//#include "store.wgsl"

@group(0) @binding(0) var finer: texture_2d<f32>;

// Weights of the texels 2 at, 2 at + 1 and 2 at + 2 along a side.
fn taps(at: u32, side: u32) -> vec3f {
    if (side == 1u) {
        return vec3f(1.0, 0.0, 0.0);
    }
    if (side % 2u == 0u) {
        return vec3f(0.5, 0.5, 0.0);
    }
    let half = side / 2u;
    return vec3f(f32(half - at), f32(half), f32(at + 1u)) / f32(side);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(finer);
    if (any(id.xy >= max(size / 2u, vec2u(1u)))) {
        return;
    }
    let at = 2u * id.xy;
    if (all(size % 2u == vec2u(0u))) {
        let above = textureLoad(finer, at, 0) + textureLoad(finer, at + vec2u(1u, 0u), 0);
        let below = textureLoad(finer, at + vec2u(0u, 1u), 0) + textureLoad(finer, at + vec2u(1u, 1u), 0);
        store(id.xy, 0.25 * (above + below));
        return;
    }
    let across = taps(id.x, size.x);
    let down = taps(id.y, size.y);
    var mean = vec4f(0.0);
    for (var y = 0u; y < 3u; y++) {
        for (var x = 0u; x < 3u; x++) {
            if (across[x] * down[y] > 0.0) {
                mean += across[x] * down[y] * textureLoad(finer, at + vec2u(x, y), 0);
            }
        }
    }
    store(id.xy, mean);
}
