// Teeth, gums and tongue: single teeth along the arch, with dark gaps and translucent edges.
//#include "eye.wgsl"

//#fill const ARCH_MM: f32 = {arch_mm};
//#fill const CROWN_MM: f32 = {crown_mm};
//#fill const BITE: f32 = {bite};
//#fill const MIDDLE: f32 = {middle};

const UPPER_TEETH: f32 = 1.0; // fourth component of a material's colour; 2 for lower teeth
const TONGUE: f32 = 3.0;
const TEETH_PER_SIDE: u32 = 7u; // teeth of half an arch
// Usual widths of teeth from the middle outwards [mm].
const UPPER_MM: array<f32, TEETH_PER_SIDE> = array<f32, TEETH_PER_SIDE>(8.6, 6.6, 7.6, 7.1, 6.8, 10.2, 9.6);
const LOWER_MM: array<f32, TEETH_PER_SIDE> = array<f32, TEETH_PER_SIDE>(5.4, 5.9, 6.9, 7.0, 7.2, 11.2, 10.5);
// Artistic values, linear.
const CROWN_HEIGHT_MM: f32 = 9.8; // visible height of a tooth [mm]
const BULGE_MM: f32 = 0.55; // of a tooth across its width
const HEIGHT_BULGE_MM: f32 = 0.45; // of a tooth from its biting edge to the gum
const ENAMEL: vec3f = vec3f(0.50, 0.465, 0.38); // L* of 73, as measured teeth [-]
const NECK: vec3f = vec3f(0.45, 0.375, 0.275);
const CLEAR_EDGE: vec3f = vec3f(0.42, 0.405, 0.36);
const GAP: vec3f = vec3f(0.42, 0.34, 0.28); // fraction of the light that leaves narrow gaps between teeth
const GUM: vec3f = vec3f(0.42, 0.15, 0.14);
const TOOTH_SHADOW_OFFSET_MM: f32 = 1.2; // light spreads about as far in dentine, so shadows on teeth start beside the lips
const SALIVA_ROUGHNESS: f32 = 0.12; // roughness of wet surfaces
const TOOTH_SHADOW_SCATTER: vec3f = vec3f(0.22, 0.20, 0.17); // fraction of a light that reaches shadowed teeth through their lit parts and from the lips
const CANINE_MM: f32 = 22.0; // distance of the canines from the middle along the arch
const SHADE_MM: f32 = 10.0; // length along the arch over which cheeks shade the teeth behind the canines to 1/e
const MOUTH_SHADOW_SCATTER: vec3f = vec3f(0.04, 0.014, 0.008); // fraction of a light that enters through some 8 mm of cheeks and lips

fn tooth_width(kind: f32, index: u32) -> f32 {
    return select(LOWER_MM[index], UPPER_MM[index], kind == UPPER_TEETH);
}

fn teeth_at(point: Point, kind: f32) -> Surface {
    let along = abs(point.uv.x - MIDDLE) * ARCH_MM;
    let height = (point.uv.y - BITE) * CROWN_MM;
    var index = 0u;
    var tooth_start = 0.0;
    loop {
        if (index + 1u >= TEETH_PER_SIDE || along < tooth_start + tooth_width(kind, index)) {
            break;
        }
        tooth_start += tooth_width(kind, index);
        index++;
    }
    let width = tooth_width(kind, index);
    let side = clamp(2.0 * (along - tooth_start) / width - 1.0, -1.0, 1.0); // -1 to 1 across the tooth
    let between = 0.5 * width * (1.0 - abs(side)); // [mm]
    let crown = CROWN_HEIGHT_MM - 1.4 * pow(abs(side), 3.0) - 0.18 * f32(index);
    let gum = smoothstep(-0.25, 0.25, height - crown);
    let gap = smoothstep(0.0, 0.12 + 0.3 * (1.0 - smoothstep(0.0, 1.5, height)), between);
    var colour = mix(ENAMEL, NECK, smoothstep(0.45, 1.0, height / crown));
    colour = mix(CLEAR_EDGE, colour, smoothstep(0.0, 1.4, height));
    colour = mix(colour * mix(GAP, vec3f(1.0), gap), GUM * mix(0.8, 1.0, gap), gum);
    let slope = -4.0 * BULGE_MM * side / width * (1.0 - gum) * sign(point.uv.x - MIDDLE);
    let down = clamp(2.0 * height / crown - 1.0, -1.0, 1.0); // -1 at the biting edge, 1 at the gum
    let rise = -4.0 * HEIGHT_BULGE_MM * down / crown * (1.0 - gum);
    let face = smoothstep(0.5, 2.5, height); // the edge is round in the mesh, and v hardly changes along it
    //#if BANDS
    return Surface(bend(point, face * vec2f(slope * ARCH_MM, rise * CROWN_MM)), in_channels(colour), SALIVA_ROUGHNESS, 1.0);
    //#else
    return Surface(bend(point, face * vec2f(slope * ARCH_MM, rise * CROWN_MM)), colour, SALIVA_ROUGHNESS, 1.0);
    //#end
}

fn tongue_at(point: Point, colour: vec3f) -> Surface {
    let noise = eye_noise(1.1 * point.position.xz, 1.0) + 0.5 * eye_noise(2.7 * point.position.xz, 2.0);
    return Surface(point.normal, colour * (0.75 + 0.35 * noise), 0.25, 1.0);
}

// Fraction of a light that reaches shadowed parts of the mouth.
fn mouth_shadow_scatter(point: Point, part: f32) -> vec3f {
    let behind_canines = max(abs(point.uv.x - MIDDLE) * ARCH_MM - CANINE_MM, 0.0);
    //#if BANDS
    return in_channels(select(TOOTH_SHADOW_SCATTER * exp(-behind_canines / SHADE_MM), MOUTH_SHADOW_SCATTER, part == TONGUE));
    //#else
    return select(TOOTH_SHADOW_SCATTER * exp(-behind_canines / SHADE_MM), MOUTH_SHADOW_SCATTER, part == TONGUE);
    //#end
}

// material: colour and part of the mouth
fn mouth_at(point: Point, material: vec4f) -> Surface {
    if (material.w == TONGUE) {
        return tongue_at(point, material.rgb);
    }
    return teeth_at(point, material.w);
}
