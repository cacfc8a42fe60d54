// Tone curves from scene light to display light.

const FILMIC: u32 = 1u;
const NEUTRAL: u32 = 2u;
const FILMIC_EXPOSURE: f32 = 2.0;
const FILMIC_WHITE: f32 = 11.2;
const COMPRESSION_START: f32 = 0.76;
const DESATURATION: f32 = 0.15;

fn toned(colour: vec3f, curve: u32) -> vec3f {
    let light = max(colour, vec3f(0.0));
    if (curve == FILMIC) {
        return film(FILMIC_EXPOSURE * light) / film(vec3f(FILMIC_WHITE));
    }
    if (curve == NEUTRAL) {
        return neutral(light);
    }
    return colour;
}

// Curve of film, with shoulder and toe. Source: [Hable2010].
fn film(light: vec3f) -> vec3f {
    let x = min(light, vec3f(1e6));
    return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
}

// Keeps colours below 0.8; compresses and desaturates brighter ones. Source: [Khronos2024].
fn neutral(light: vec3f) -> vec3f {
    let least = min(light.r, min(light.g, light.b));
    let shifted = light - select(0.04, least - 6.25 * least * least, least < 0.08);
    let peak = max(shifted.r, max(shifted.g, shifted.b));
    if (peak < COMPRESSION_START) {
        return shifted;
    }
    let d = 1.0 - COMPRESSION_START;
    let compressed = 1.0 - d * d / (peak + d - COMPRESSION_START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - compressed) + 1.0);
    return mix(shifted * (compressed / peak), vec3f(compressed), white);
}
