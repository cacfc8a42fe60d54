// Scales every texel by a factor: the smallest pass there is.

struct Factor {
    value: f32,
}

@group(0) @binding(0) var<uniform> factor: Factor;
@group(0) @binding(1) var image: texture_2d<f32>;
@group(0) @binding(2) var scaled: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(image))) {
        textureStore(scaled, id.xy, factor.value * textureLoad(image, id.xy, 0));
    }
}
