// Colour, relief and gloss of the skin at each texel of its maps, from pigments, marks and lines of the face.
//#include "spot.wgsl"
//#include "marks.wgsl"
//#include "lines.wgsl"

@group(0) @binding(3) var<storage, read> owners: array<u32>;
@group(0) @binding(10) var colour_tables: texture_2d_array<f32>; // of skin with the lowest and highest oxygen, and of lips, over the square roots of blood and melanin fractions
@group(0) @binding(11) var colour: texture_storage_2d<rgba16float, write>;
@group(0) @binding(12) var specular: texture_storage_2d<rgba16float, write>;
@group(0) @binding(13) var roughness: texture_storage_2d<rgba16float, write>;
@group(0) @binding(15) var expression_deltas: texture_storage_2d_array<rgba16float, write>; // changes by movements, see expression.wgsl
@group(0) @binding(14) var<storage, read_write> heights: array<f32>; // with a border of one texel [mm]

// Artistic values.
const PATCHES: f32 = 0.22; // amplitude of patches of melanin [doublings]
const SPECKLES: f32 = 0.16; // amplitude of fine unevenness of melanin [doublings]
const BLOTCHES: f32 = 0.40; // amplitude of blotches of blood [doublings]
const CAPILLARIES: f32 = 0.31; // amplitude of the mottling by capillaries [doublings]
const THREADS: f32 = 0.6; // blood in visible capillaries [doublings]
const THREAD_MM: f32 = 0.35; // width of visible capillaries [mm]
const BLEMISH_BLOOD: f32 = 1.7;
const SCAR_BLOOD: f32 = 0.5;
const FRECKLE: f32 = 1.7;
const AGE_SPOT: f32 = 1.3;
const MOLE: f32 = 3.4;
const TAN: f32 = 1.2; // melanin of the most exposed skin relative to covered skin [doublings]
const TYPICAL_TAN: f32 = 0.3; // tan that the measured differences between sites include
const LIPS: u32 = 2u; // index of the colour table of lips
const LIP_BLOOD: f32 = 1.9;
const LIP_MELANIN: f32 = 0.5;
const MUCOSA_BLOOD: f32 = 3.2;
const RED_LIDS: f32 = 0.8;
const RED_SLIT: f32 = 1.0;
const BEARD_COLOUR: vec3f = vec3f(0.11, 0.10, 0.095);
const DEEP_VEINS: f32 = 0.7;
const VEIN_COLOUR: vec3f = vec3f(0.80, 0.90, 1.0); // factor of the skin colour
const STRENGTH: f32 = 0.86; // strength of the specular reflection, relative to the default
const OILY_STRENGTH: f32 = 0.44;
const ROUGHNESS: f32 = 0.36;
const OILY_ROUGHNESS: f32 = -0.10;
const LIP_STRENGTH: f32 = 0.28;
const LIP_ROUGHNESS: f32 = -0.07;
const WET_STRENGTH: f32 = 0.55; // added inside the mouth and on the lids' edges
const WET_ROUGHNESS: f32 = -0.12;
const INNER_LID: vec3f = vec3f(0.46, 0.19, 0.155); // inner side of the lids, and the caruncle
const TEARS: f32 = 0.11; // roughness of the inner side of the lids
const PORES: f32 = 0.4; // amount of pores outside zones
const MIDLINE_MM: f32 = 4.0; // half of the width over which tension lines of both halves of the face meet
const UNEVEN: f32 = 0.15; // relative variation of gloss by uneven oil

override BANDS: bool = false; // whether wavelengths take the place of red, green and blue

//#if BANDS
// Reflectance of an RGB colour at the three wavelengths of the channels.
fn in_channels(rgb: vec3f) -> vec3f {
    return vec3f(dot(paint.bands[0].xyz, rgb), dot(paint.bands[1].xyz, rgb), dot(paint.bands[2].xyz, rgb));
}
//#end

// Colour for fractions of melanin and blood, interpolated bilinearly in their square roots.
fn colour_of(table: u32, melanin: f32, blood: f32) -> vec3f {
    let nodes = f32(textureDimensions(colour_tables).x);
    let place = sqrt(saturate(vec2f(blood, melanin))) * (nodes - 1.0);
    let before = min(floor(place), vec2f(nodes - 2.0));
    let part = place - before;
    let at = vec2u(before);
    let near = mix(entry(table, at), entry(table, at + vec2u(1u, 0u)), part.x);
    let far = mix(entry(table, at + vec2u(0u, 1u)), entry(table, at + vec2u(1u, 1u)), part.x);
    return mix(near, far, part.y);
}

// Colour of skin with the oxygen saturation of its site.
fn skin_colour(melanin: f32, blood: f32) -> vec3f {
    let oxygen = clamp(paint.oxygen + zone_of(ZONE_OXYGEN), paint.low_oxygen, paint.high_oxygen);
    let part = (oxygen - paint.low_oxygen) / (paint.high_oxygen - paint.low_oxygen);
    return mix(colour_of(0u, melanin, blood), colour_of(1u, melanin, blood), part);
}

fn entry(table: u32, at: vec2u) -> vec3f {
    return textureLoad(colour_tables, at, table, 0).rgb;
}

// Thin branching lines along the zeros of a noise, and a blue shade of vessels that lie deeper.
fn veins() -> f32 {
    let near = 1.0 - smoothstep(0.0, 0.10, abs(noise[NOISE_VEINS] + 0.08 * noise[NOISE_SUN]));
    return (near + DEEP_VEINS) * saturate(zone_of(ZONE_VEINS)) * paint.veins;
}

// Weight of the inner side of the lids, which is pink and wet.
fn inner_lid(spot: Spot) -> f32 {
    return smoothstep(0.1, -0.45, spot.fields.z);
}

// Blood of capillaries: red spots and nets over paler skin, and single vessels where there are many [doublings].
fn capillaries(spot: Spot) -> f32 {
    let many = saturate(zone_of(ZONE_CAPILLARIES));
    let n = noise[NOISE_CAPILLARIES];
    let mottling = CAPILLARIES * (0.45 + 0.75 * many) * (n + 0.7 * max(n, 0.0) * n);
    let thread = 1.0 - smoothstep(0.02, 0.09, abs(n + 0.35 * noise[NOISE_SPECKLES]));
    return 2.0 * paint.redness * (mottling + THREADS * saturate(2.5 * many - 1.2) * thread * visible(THREAD_MM, 0.5 * spot.texel_mm));
}

fn pigments(spot: Spot, lip: f32, mucosa: f32) -> vec2f {
    var brown = zone_of(ZONE_MELANIN) * (1.0 - lip) + LIP_MELANIN * lip + PATCHES * noise[NOISE_PATCHES] + SPECKLES * noise[NOISE_SPECKLES];
    brown += FRECKLE * smoothstep(0.02, 0.3, dotted[DOT_FRECKLES] + 0.7 * dotted[DOT_SMALL_FRECKLES]);
    brown += AGE_SPOT * smoothstep(0.05, 0.4, dotted[DOT_AGE_SPOTS]) + MOLE * smoothstep(0.1, 0.6, dotted[DOT_MOLES]);
    let clothed = smoothstep(-165.0, -205.0, spot.body.y + 6.0 * noise[NOISE_WANDER_Y]);
    brown += TAN * (0.35 * (paint.tan - TYPICAL_TAN) * saturate(zone_of(ZONE_SUN)) - 0.5 * paint.tan * clothed);
    var red = (2.0 * paint.redness * zone_of(ZONE_BLOOD) + capillaries(spot)) * (1.0 - lip) + BLOTCHES * noise[NOISE_BLOTCHES];
    red += BLEMISH_BLOOD * smoothstep(0.0, 0.4, dotted[DOT_BLEMISHES]) + SCAR_BLOOD * smoothstep(0.0, 0.5, dotted[DOT_SCARS]);
    let slit = RED_SLIT * (1.0 - smoothstep(0.0, 2.2, spot.fields.y));
    red += lip * (LIP_BLOOD + 0.3 * noise[NOISE_LIP_STREAKS] + slit) + mucosa * (MUCOSA_BLOOD - lip * (LIP_BLOOD + RED_SLIT));
    red += RED_LIDS * (1.0 - smoothstep(0.3, 1.8, spot.fields.z));
    brown -= 3.0 * mucosa;
    return vec2f(paint.melanin, paint.blood) * exp2(vec2f(brown, red));
}

fn over(below: vec3f, above: vec3f, share: f32) -> vec3f {
    return mix(below, min(above, below), share); // dark colours do not become lighter
}

// Specular strength relative to the default, and roughness.
fn gloss(lip: f32, wet: f32, hair: f32, tears: f32) -> vec2f {
    let film = noise[NOISE_OIL_FILM] + 0.7 * noise[NOISE_FINE_FILM];
    let zones = 0.5 + 1.25 * paint.oil;
    var strength = STRENGTH + OILY_STRENGTH * paint.oil + zones * zone_of(ZONE_STRENGTH) + LIP_STRENGTH * lip + WET_STRENGTH * wet;
    strength *= (1.0 + UNEVEN * film) * (1.0 - 0.4 * hair);
    var m = ROUGHNESS + OILY_ROUGHNESS * paint.oil + zones * zone_of(ZONE_ROUGHNESS) + LIP_ROUGHNESS * lip + WET_ROUGHNESS * wet;
    m *= 1.0 - 0.5 * UNEVEN * film;
    return vec2f(clamp(strength, 0.3, 2.2), mix(clamp(m, 0.15, 0.6), TEARS, tears));
}

// flush, pressed : gain of blood by a flush, and its loss by pressure [-]
fn store_deltas(at: vec2u, share: f32, flush: f32, pressed: f32) {
    textureStore(expression_deltas, at, 0, share * vec4f(deepened[0], deepened[1], deepened[2], deepened[3]));
    textureStore(expression_deltas, at, 1, vec4f(share * vec3f(deepened[4], deepened[5], deepened[6]), flush - pressed));
}

// amounts : of pores and of lines, log2 of the mm per unit of uv, and direction of the tension lines
fn store_texel(at: vec2u, rgb: vec3f, shine: vec2f, height: f32, amounts: vec4f, pigments: vec2f) {
    textureStore(colour, at, vec4f(rgb, 1.0));
    textureStore(specular, at, vec4f(shine.x, amounts.x, amounts.z, amounts.w));
    textureStore(roughness, at, vec4f(shine.y, amounts.y, saturate(pigments)));
    heights[(at.y + 1u) * (paint.side + 2u) + at.x + 1u] = height;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(paint.side))) {
        return;
    }
    let owner = owners[id.y * paint.side + id.x];
    if (owner == 0u) {
        let shine = vec2f(STRENGTH + OILY_STRENGTH * paint.oil, ROUGHNESS + OILY_ROUGHNESS * paint.oil);
        store_deltas(id.xy, 0.0, 0.0, 0.0);
        for (var k = 0u; k < AMOUNT_ROWS; k++) {
            zone[k] = vec4f(0.0);
        }
        store_texel(id.xy, skin_colour(paint.melanin, paint.blood), shine, 0.0, vec4f(0.0), vec2f(paint.melanin, paint.blood));
        return;
    }
    let spot = spot_of(owner, id.xy);
    make_textures(spot);
    let lip = smoothstep(LIP_MM.x, LIP_MM.y, spot.fields.x + LIP_WANDER_MM * noise[NOISE_LIP_EDGE]);
    let mucosa = smoothstep(0.5, -2.5, spot.fields.y);
    let scalp = scalp_at(spot);
    scatter_dots(spot, scalp, lip);
    let inner = inner_lid(spot);
    let p = pigments(spot, lip, mucosa);
    var rgb = mix(skin_colour(p.x, p.y), colour_of(LIPS, p.x, p.y), lip);
    //#if BANDS
    rgb *= mix(vec3f(1.0), in_channels(VEIN_COLOUR), veins());
    //#else
    rgb *= mix(vec3f(1.0), VEIN_COLOUR, veins());
    //#end
    let bristles = 0.85 + 0.15 * dotted[DOT_STUBBLE];
    let beard = 0.55 * paint.beard * saturate(zone_of(ZONE_BEARD)) * (1.0 - lip) * (0.45 + 0.9 * dotted[DOT_STUBBLE]);
    rgb = mix(rgb, paint.stubble_colour, paint.stubble * scalp * bristles);
    //#if BANDS
    rgb = over(rgb, in_channels(BEARD_COLOUR), beard);
    //#else
    rgb = over(rgb, BEARD_COLOUR, beard);
    //#end
    let wet = max(mucosa, 1.0 - smoothstep(0.2, 1.2, spot.fields.z));
    //#if BANDS
    rgb = mix(rgb, in_channels(INNER_LID) * (1.0 + 0.15 * noise[NOISE_BLOTCHES]), 0.85 * inner);
    //#else
    rgb = mix(rgb, INNER_LID * (1.0 + 0.15 * noise[NOISE_BLOTCHES]), 0.85 * inner);
    //#end
    let away = f32(NEAREST - (owner >> ID_BITS)) / STEPS;
    let fade = 1.0 - smoothstep(0.5 * MARGIN, MARGIN, away); // to 0 outside the charts
    let height = relief(spot, lip) * fade * (1.0 - inner);
    store_deltas(id.xy, fade, saturate(zone_of(ZONE_FLUSH)) * (1.0 - lip), lip);
    let bare = (1.0 - lip) * (1.0 - mucosa) * (1.0 - inner);
    let pores = clamp(PORES + zone_of(ZONE_PORES), 0.0, 1.5) * (0.75 + 0.6 * paint.oil) * bare;
    let furrows = max(1.0 + zone_of(ZONE_FURROWS), 0.2) * bare * (0.8 + 2.2 * paint.age * paint.age);
    let tension = clamp(spot.body.x / MIDLINE_MM, -1.0, 1.0) * clamp(zone_of(ZONE_TENSION), -1.4, 1.4);
    let amounts = vec4f(pores, furrows, spot.density, tension);
    store_texel(id.xy, rgb, gloss(lip, wet, max(scalp * paint.stubble, beard), inner), height, amounts, p);
}
