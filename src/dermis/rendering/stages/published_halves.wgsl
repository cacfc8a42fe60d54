// Light stored again as halves, which samplers may filter everywhere.

@group(0) @binding(0) var light: texture_2d<f32>;
@group(0) @binding(1) var halves: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (all(id.xy < textureDimensions(light))) {
        textureStore(halves, id.xy, textureLoad(light, id.xy, 0));
    }
}
