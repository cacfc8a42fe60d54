// Stretch at half the resolution: the mean of four texels. Gutter texels only count if all four texels are in gutters.
//#include "halves.wgsl"
//#include "reach.wgsl"

@group(0) @binding(0) var finer: texture_2d<f32>;
@group(0) @binding(1) var reach_map: texture_2d<u32>; // of the finer atlas
@group(0) @binding(2) var stretch_map: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= textureDimensions(stretch_map))) {
        return;
    }
    var own = vec4f(0.0); // sum and count
    var all = vec4f(0.0);
    for (var k = 0u; k < 4u; k++) {
        let at = 2u * id.xy + vec2u(k & 1u, k >> 1u);
        let stretch = textureLoad(finer, at, 0);
        if (stretch.x > 0.0) {
            let counted = vec4f(stretch.xyz, 1.0);
            all += counted;
            if (!is_gutter(textureLoad(reach_map, at, 0))) {
                own += counted;
            }
        }
    }
    let sum = select(all, own, own.w > 0.0);
    textureStore(stretch_map, id.xy, rounded_to_halves(vec4f(sum.xyz / max(sum.w, 1.0) * vec3f(0.5, 0.5, 1.0), 0.0)));
}
