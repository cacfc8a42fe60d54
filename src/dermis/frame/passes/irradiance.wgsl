// Light that enters the skin at each texel of the atlas, times the share of the colour map applied before scattering.
//#include "lighting.wgsl"
//#include "packed_surface.wgsl"
//#include "store.wgsl"

struct Entering {
    scale: f32, // factor from light to what is stored
    area: f32, // over which texels average light that is finer: standard deviation [texel]
}

@group(0) @binding(30) var surfaces: texture_2d_array<u32>; // as surface_texels.wgsl packs them
@group(0) @binding(31) var<uniform> entering: Entering;

// mm from a texel to the next along an axis, by the nearer of its neighbours on both sides; 0 where neither shows surface.
fn texel_step(at: vec2i, position: vec3f, axis: vec2i) -> vec3f {
    let last = vec2i(textureDimensions(surfaces)) - 1;
    var found = vec3f(0.0);
    for (var side = -1; side <= 1; side += 2) {
        let beside = at + side * axis;
        let within = clamp(beside, vec2i(0), last);
        let there = bitcast<vec3f>(textureLoad(surfaces, within, 0, 0).xyz);
        let shown = textureLoad(surfaces, within, 1, 0).w != 0u && all(beside == within);
        let step = there - position;
        let nearer = dot(found, found) == 0.0 || dot(step, step) < dot(found, found);
        found = select(found, step, shown && nearer);
    }
    return found;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfaces);
    if (any(id.xy >= size)) {
        return;
    }
    let packed = Packed(textureLoad(surfaces, id.xy, 0, 0), textureLoad(surfaces, id.xy, 1, 0));
    if (packed.look.w == 0u) {
        store(id.xy, vec4f(0.0));
        return;
    }
    let surface = unpack_surface(packed);
    if (STRIPE_LIGHT && entering.area > 0.0) {
        let position = bitcast<vec3f>(packed.place.xyz);
        area_u = entering.area * texel_step(vec2i(id.xy), position, vec2i(1, 0));
        area_v = entering.area * texel_step(vec2i(id.xy), position, vec2i(0, 1));
    }
    var point = unpack_point(packed);
    point.place = (vec2f(id.xy) + 0.5) / vec2f(size);
    // Any view will do: the reflection is not used, so the compiler drops it.
    let lit = light_up(point, surface, surface.normal, open_at(point.place));
    store(id.xy, vec4f(entering.scale * lit.entered * share_of(surface.colour, skin.mix), 1.0));
}
