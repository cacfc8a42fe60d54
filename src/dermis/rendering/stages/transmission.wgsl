// Light that comes through thin parts: what has spread on the other side, as far as the flesh between lets it pass.
//#include "normal_distribution.wgsl"
//#include "bilinear.wgsl"

struct Through {
    first: u32, // blurred layer
    count: u32,
    gaussian: array<vec4f, 24>, // weight per channel, standard deviation [mm]
}

@group(0) @binding(0) var<uniform> through: Through;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var opposite: texture_2d<u32>; // place in the atlas, thickness, distances to the rim on either side
@group(0) @binding(3) var transmitted: texture_storage_2d<rgba32float, write>;

const THICK: f32 = 4.0; // standard deviations that hardly anything passes

fn level_at(place: vec2f, layer: u32) -> vec3f {
    let size = vec2i(textureDimensions(levels));
    let at = place * vec2f(size) - 0.5;
    let a = clamp(vec2i(floor(at)), vec2i(0), size - 1);
    let b = clamp(vec2i(floor(at)) + 1, vec2i(0), size - 1);
    let w = bilinear_weights(at);
    let light = w.x * textureLoad(levels, a, layer, 0) + w.y * textureLoad(levels, vec2i(b.x, a.y), layer, 0)
        + w.z * textureLoad(levels, vec2i(a.x, b.y), layer, 0) + w.w * textureLoad(levels, b, layer, 0);
    return light.rgb;
}

// A Gaussian of distance sqrt(r^2 + d^2) is exp(-d^2 / 2v) G(v, r) [dEonLuebke2007]. Near a rim the light that both
// sides share over it is taken apart first, so that none counts twice: what is beyond the rim lies nearer by the surface.
fn passes(here: vec3f, there: vec3f, thickness: f32, rim: vec2f) -> vec3f {
    let over = beyond_line(rim.x); // share of this side's blur that comes from the other
    let f = exp(-0.5 * thickness * thickness);
    let share = clamp((f * (1.0 - beyond_line(rim.y)) - over) / max(1.0 - 2.0 * over, 1e-4), 0.0, 1.0);
    return share * max(vec3f(0.0), (1.0 - over) * there - over * here);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let side = textureDimensions(transmitted);
    if (any(id.xy >= side)) {
        return;
    }
    let other = textureLoad(opposite, id.xy, 0);
    let shape = bitcast<vec3f>(other.yzw);
    if (shape.x < 0.0) {
        textureStore(transmitted, id.xy, vec4f(0.0)); // no surface
        return;
    }
    let at = vec2u((vec2f(id.xy) + 0.5) * vec2f(textureDimensions(levels)) / vec2f(side));
    var sum = vec3f(0.0);
    // From wide to narrow, to stop where the rest is too narrow: that costs nothing where it is thick.
    for (var k = through.count; k > 0u && shape.x < THICK * through.gaussian[k - 1u].w; k--) {
        let gaussian = through.gaussian[k - 1u];
        let layer = through.first + k - 1u;
        let scaled = shape / gaussian.w;
        let there = level_at(unpack2x16unorm(other.x), layer);
        sum += gaussian.rgb * passes(textureLoad(levels, at, layer, 0).rgb, there, scaled.x, scaled.yz);
    }
    textureStore(transmitted, id.xy, vec4f(sum, 1.0));
}
