// Seven bilinear taps of light and of the stretch map along one axis [dEonLuebke2007].

override AXIS: u32 = 0u; // 0 along u, 1 along v
override SKIPPED: bool = false; // whether empty texels are excluded, as the alpha method of the talk does

const MIN_WEIGHT: f32 = 1e-3; // least sum of weights that is normalised

struct Spread {
    sigma_mm: f32, // of this blur
    clear: vec3f, // light of empty texels
}

struct Blurred {
    light: vec4f,
    stretch: vec4f,
}

@group(0) @binding(0) var<uniform> spread: Spread;
@group(0) @binding(1) var source: texture_2d<f32>; // filtered
@group(0) @binding(2) var stretch: texture_2d<f32>; // filtered
@group(0) @binding(3) var linear: sampler;

// uv : position of the texel
fn blurred_at(uv: vec2f) -> Blurred {
    var weights = array(0.006, 0.061, 0.242, 0.383, 0.242, 0.061, 0.006); // as published: the sum is 1.001, the variance 1.08
    let per_mm = textureSampleLevel(stretch, linear, uv, 0.0)[AXIS];
    let axis = select(vec2f(0.0, 1.0), vec2f(1.0, 0.0), AXIS == 0u);
    let step = axis * spread.sigma_mm * per_mm / vec2f(textureDimensions(source));
    var light = vec4f(0.0);
    var wide = vec4f(0.0);
    for (var n = 0; n < 7; n++) {
        let at = uv + f32(n - 3) * step;
        let tap = textureSampleLevel(source, linear, at, 0.0);
        if (SKIPPED) {
            light += weights[n] * vec4f(tap.rgb, tap.a); // empty texels hold no light
        } else {
            light += weights[n] * vec4f(tap.rgb + (1.0 - tap.a) * spread.clear, 1.0);
        }
        wide += weights[n] * textureSampleLevel(stretch, linear, at, 0.0);
    }
    if (SKIPPED) {
        light = vec4f(light.rgb / max(light.a, MIN_WEIGHT), select(0.0, 1.0, light.a > MIN_WEIGHT));
    } else {
        light.a = 1.0; // not the weights' sum, or the next pass would subtract some of the clear colour
    }
    return Blurred(light, wide);
}
