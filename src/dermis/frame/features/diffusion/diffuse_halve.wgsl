// Light at half the resolution: each texel is the mean of those texels in its 2 x 2 square that show surface.
//#include "source.wgsl"
//#include "store.wgsl"

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(source) / 2u;
    if (all(id.xy < size)) {
        let light = source_at((vec2f(id.xy) + 0.5) / vec2f(size)); // the corner that the four texels share
        store(id.xy, light / max(light.a, 0.25));
    }
}
