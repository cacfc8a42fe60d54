// Copies a texture texel by texel: the least that any pass over a texture does.

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var copied: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(source))) {
        textureStore(copied, id.xy, textureLoad(source, id.xy, 0));
    }
}
