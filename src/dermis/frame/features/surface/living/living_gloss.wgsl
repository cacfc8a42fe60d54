// Gloss and blood of skin in a state such as exertion: sweat and tears make it smoother and more reflective.

struct Gloss {
    side: u32, // of the maps [texels]
}

// Limits of the effect of states; skin that exceeds them at rest keeps its values.
const MAX_STRENGTH: f32 = 2.2;
const MIN_ROUGHNESS: f32 = 0.15;

@group(0) @binding(0) var<uniform> gloss: Gloss;
@group(0) @binding(1) var specular_at_rest: texture_2d<f32>; // see store_texel in skin.wgsl
@group(0) @binding(2) var roughness_at_rest: texture_2d<f32>;
@group(0) @binding(3) var state_map: texture_2d<f32>; // base-2 logarithm of the factor of blood, and changes of oxygen, strength and roughness
@group(0) @binding(4) var specular: texture_storage_2d<rgba16float, write>;
@group(0) @binding(5) var roughness: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(gloss.side))) {
        return;
    }
    let change = textureLoad(state_map, id.xy, 0);
    var shine = textureLoad(specular_at_rest, id.xy, 0);
    var rough = textureLoad(roughness_at_rest, id.xy, 0);
    shine.x = clamp(shine.x + change.z, 0.0, max(shine.x, MAX_STRENGTH));
    rough.x = max(rough.x + change.w, min(rough.x, MIN_ROUGHNESS));
    rough.w = saturate(rough.w * exp2(change.x));
    textureStore(specular, id.xy, shine);
    textureStore(roughness, id.xy, rough);
}
