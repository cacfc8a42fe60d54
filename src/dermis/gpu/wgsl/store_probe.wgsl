// Stores known values to a half-float texture, to find out how a device rounds them.

@group(0) @binding(0) var<uniform> size: vec4u;
@group(0) @binding(1) var rounded: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let value = 1.0 + f32(id.y * size.x + id.x) / 65536.0;
    textureStore(rounded, id.xy, vec4f(value));
}
