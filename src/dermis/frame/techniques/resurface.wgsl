// Picture of skin with screen-space scattering: diffused light times its transmittance towards the camera, plus all other
// light.

@group(0) @binding(0) var surface: texture_2d<f32>; // light that does not scatter; alpha is coverage
@group(0) @binding(1) var subsurface: texture_2d<f32>; // light below the skin, diffused
@group(0) @binding(2) var transmittance: texture_2d<f32>; // fraction of that light that leaves towards the camera
@group(0) @binding(3) var picture: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(surface))) {
        return;
    }
    let top = textureLoad(surface, id.xy, 0);
    let light = textureLoad(subsurface, id.xy, 0).rgb * textureLoad(transmittance, id.xy, 0).rgb;
    textureStore(picture, id.xy, vec4f(top.rgb + light, top.a));
}
