// Colour of a face with an expression, which moves blood, and of living skin, whose blood also changes with its state and the pulse.

struct Expression {
    flush: f32, // amount by which the face reddens
    pressed: f32, // amount by which blood is pressed out of the lips
    side: u32, // of the maps [texels]
    bands: array<vec4f, 3>, // matrix from RGB colours to the channels of the maps, by rows
}

// Factors by which a full flush, and a full loss of blood, multiply the skin colour: artistic values.
const FLUSH: vec3f = vec3f(0.97, 0.80, 0.82);
const PALE: vec3f = vec3f(1.08, 1.22, 1.20);

override LIVING: bool = false; // whether states and the pulse change the blood

@group(0) @binding(0) var<uniform> expression: Expression;
@group(0) @binding(1) var colour_at_rest: texture_2d<f32>;
@group(0) @binding(2) var expression_deltas: texture_2d_array<f32>; // see expression_relief.wgsl; the last channel is the gain or loss of blood
@group(0) @binding(5) var colour: texture_storage_2d<rgba16float, write>;

override BANDS: bool = false; // whether wavelengths take the place of red, green and blue

//#if BANDS
// Reflectance of an RGB colour at the three wavelengths of the channels.
fn in_channels(rgb: vec3f) -> vec3f {
    return vec3f(dot(expression.bands[0].xyz, rgb), dot(expression.bands[1].xyz, rgb), dot(expression.bands[2].xyz, rgb));
}
//#end

//#if LIVING
//#fill const PULSE_SAMPLES: u32 = 4u * {pulse_rows}u;

struct Living {
    oxygen_per_layer: f32, // decrease of the oxygen saturation from the first to the second layer of blood_tables
    longest_delay_s: f32, // delay at the last sample of the pulse
    //#fill pulse: array<vec4f, {pulse_rows}>, // changes of the blood volume at evenly spaced delays, relative
}

@group(0) @binding(6) var roughness_at_rest: texture_2d<f32>; // zw: fractions of melanin and blood
@group(0) @binding(7) var state_map: texture_2d<f32>; // base-2 logarithm of the factor of blood, and change of oxygen
@group(0) @binding(8) var pulse_map: texture_2d<f32>; // sums of weighted amplitude and weighted delay [s], and of weights
@group(0) @binding(9) var blood_tables: texture_2d_array<f32>; // see blood_tables in living.py
@group(0) @binding(10) var<uniform> living: Living;

// Entry of a table for fractions of melanin and blood, interpolated bilinearly in their square roots.
fn blood_entry(table: u32, melanin: f32, blood: f32) -> vec3f {
    let nodes = f32(textureDimensions(blood_tables).x);
    let place = sqrt(saturate(vec2f(blood, melanin))) * (nodes - 1.0);
    let before = min(floor(place), vec2f(nodes - 2.0));
    let part = place - before;
    let at = vec2u(before);
    let near = mix(textureLoad(blood_tables, at, table, 0), textureLoad(blood_tables, at + vec2u(1u, 0u), table, 0), part.x);
    let far = mix(textureLoad(blood_tables, at + vec2u(0u, 1u), table, 0), textureLoad(blood_tables, at + vec2u(1u, 1u), table, 0), part.x);
    return mix(near, far, part.y).rgb;
}

// Relative change of the blood volume by the pulse, with the delay of a texel [s].
fn pulse_at(delay_s: f32) -> f32 {
    let place = saturate(delay_s / living.longest_delay_s) * f32(PULSE_SAMPLES - 1u);
    let before = min(u32(place), PULSE_SAMPLES - 2u);
    let next = before + 1u;
    return mix(living.pulse[before / 4u][before % 4u], living.pulse[next / 4u][next % 4u], place - f32(before));
}

// Pseudo-random number from 0.01 to 0.99; with these limits, rounding errors do not change values that are exact half floats.
fn threshold(index: u32) -> f32 {
    let mixed = (index * 747796405u + 2891336453u) ^ (index >> 7u);
    let word = ((mixed >> ((mixed >> 28u) + 4u)) ^ mixed) * 277803737u;
    return 0.01 + 0.98 * f32(((word >> 22u) ^ word) >> 8u) / 16777216.0;
}

// One of the two half floats around a value, such that the mean over many texels is that of the values. Rounding to the nearest
// would suppress the pulse, because values at rest are half floats and the pulse is smaller than half of their steps.
fn dithered_half(value: f32, index: u32) -> f32 {
    let step = ldexp(1.0, max(frexp(value).exp, -13) - 11);
    return floor(value / step + threshold(index)) * step;
}

fn living_colour(rest: vec3f, at: vec2u) -> vec3f {
    let c = rest * living_factor(at);
    let index = 3u * (at.y * expression.side + at.x);
    return vec3f(dithered_half(c.r, index), dithered_half(c.g, index + 1u), dithered_half(c.b, index + 2u));
}

// Factor by which changes of blood and oxygen multiply the colour.
fn living_factor(at: vec2u) -> vec3f {
    let pigments = textureLoad(roughness_at_rest, at, 0).zw;
    let change = textureLoad(state_map, at, 0);
    let sums = textureLoad(pulse_map, at, 0).xyz / textureLoad(pulse_map, at, 0).z;
    let blood = pigments.y * exp2(change.x);
    let less_oxygen = saturate(-change.y / living.oxygen_per_layer);
    var log_factor = vec3f(0.0);
    if (any(change.xy != vec2f(0.0))) {
        let changed = mix(blood_entry(0u, pigments.x, blood), blood_entry(1u, pigments.x, blood), less_oxygen);
        log_factor = changed - blood_entry(0u, pigments.x, pigments.y);
    }
    let gain = sums.x * pulse_at(sums.y);
    return exp(log_factor + log(1.0 + gain) * blood_entry(2u, pigments.x, blood));
}
//#else
fn living_colour(rest: vec3f, at: vec2u) -> vec3f {
    return rest;
}
//#end

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(expression.side))) {
        return;
    }
    let blood = textureLoad(expression_deltas, id.xy, 1, 0).w;
    //#if BANDS
    let flushed = pow(in_channels(FLUSH), vec3f(expression.flush * max(blood, 0.0)));
    //#else
    let flushed = pow(FLUSH, vec3f(expression.flush * max(blood, 0.0)));
    //#end
    //#if BANDS
    let pale = pow(in_channels(PALE), vec3f(expression.pressed * max(-blood, 0.0)));
    //#else
    let pale = pow(PALE, vec3f(expression.pressed * max(-blood, 0.0)));
    //#end
    let rest = textureLoad(colour_at_rest, id.xy, 0);
    textureStore(colour, id.xy, vec4f(living_colour(rest.rgb * flushed * pale, id.xy), rest.a));
}
