// Copy of a texture, the cheapest pass over all of its texels.

@group(0) @binding(0) var source: texture_2d<f32>;
@group(0) @binding(1) var destination: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(source))) {
        textureStore(destination, id.xy, textureLoad(source, id.xy, 0));
    }
}
