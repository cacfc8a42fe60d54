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
const TOOTH_SHADOW_OFFSET_MM: f32 = 0.3; // of the points at which shadows of lips on teeth are evaluated
const SALIVA_ROUGHNESS: f32 = 0.12; // roughness of wet surfaces
// Walls of the cavity: albedo, and area of the tongue, the palate and the inner sides of the teeth, and of the space between teeth and lips [mm^2].
const LINING: vec3f = vec3f(0.45, 0.2, 0.17);
const MOUTH_WALLS_MM2: f32 = 7000.0;
const VESTIBULE_WALLS_MM2: f32 = 2500.0;
// The tongue: depth and half width of its groove [mm], distance behind its tip at which the groove begins, and slope of its papillae.
const GROOVE_MM: f32 = 1.3;
const GROOVE_HALF_WIDTH_MM: f32 = 2.4;
const GROOVE_FROM_MM: f32 = 5.0;
const PAPILLA_SLOPE: f32 = 0.35;
const PAPILLAE_PER_MM: f32 = 1.1;
const TONGUE_ROUGHNESS: f32 = 0.3; // between papillae
const FUNGIFORM: vec3f = vec3f(1.1, 0.62, 0.6); // colour of round papillae relative to the tongue
const COATING: vec3f = vec3f(0.52, 0.36, 0.32); // of the back of the tongue

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

// axes: see Shade
fn tongue_at(point: Point, colour: vec3f, axes: array<vec4f, 2>) -> Surface {
    let uv = vec3f(point.uv, 1.0);
    let at = vec2f(dot(axes[0].xyz, uv), dot(axes[1].xyz, uv)); // from the midline, behind the tip [mm]
    let above = smoothstep(-0.2, 0.5, point.normal.y);
    let groove = above * smoothstep(0.0, GROOVE_FROM_MM, at.y - GROOVE_FROM_MM) * exp(-pow(at.x / GROOVE_HALF_WIDTH_MM, 2.0));
    let fine = PAPILLAE_PER_MM * at;
    let noise = eye_noise(fine, 1.0);
    let bumps = vec2f(eye_noise(fine + vec2f(0.5, 0.0), 1.0) - eye_noise(fine - vec2f(0.5, 0.0), 1.0), eye_noise(fine + vec2f(0.0, 0.5), 1.0) - eye_noise(fine - vec2f(0.0, 0.5), 1.0));
    let slope = PAPILLA_SLOPE * above * bumps + vec2f(2.0 * GROOVE_MM / (GROOVE_HALF_WIDTH_MM * GROOVE_HALF_WIDTH_MM) * at.x * groove, 0.0);
    let coated = mix(colour, COATING, 0.5 * above * smoothstep(8.0, 30.0, at.y) * (0.6 + 0.4 * noise));
    let spots = above * smoothstep(0.72, 0.85, eye_noise(0.6 * at, 3.0));
    let shown = coated * mix(vec3f(1.0), FUNGIFORM, 0.5 * spots) * (0.8 + 0.3 * noise) * (1.0 - 0.45 * groove);
    // slopes along x and z as derivatives along u and v
    let along_uv = slope.x * axes[0].xy + slope.y * axes[1].xy;
    //#if BANDS
    return Surface(bend(point, along_uv), in_channels(shown), mix(SALIVA_ROUGHNESS, TONGUE_ROUGHNESS, above), 1.0);
    //#else
    return Surface(bend(point, along_uv), shown, mix(SALIVA_ROUGHNESS, TONGUE_ROUGHNESS, above), 1.0);
    //#end
}

// Fraction of a light that reaches shadowed parts of the mouth: the flux through the opening between the lips, reflected within the
// cavity as in an integrating sphere.
// open: fraction of the sky that the point sees; the rest are walls. opening: [mm^2]
fn mouth_shadow_scatter(part: f32, open: f32, opening: f32) -> vec3f {
    let f = min(opening / select(VESTIBULE_WALLS_MM2, MOUTH_WALLS_MM2, part == TONGUE), 0.5);
    let scattered = (1.0 - open) * f * LINING / (1.0 - LINING * (1.0 - f));
    //#if BANDS
    return in_channels(scattered);
    //#else
    return scattered;
    //#end
}

// Factor of ambient light: it is reflected by the lining of the mouth instead of surfaces of the colour of the point.
fn ambient_among_lining(colour: vec3f, open: f32) -> vec3f {
    if (!ENVIRONMENT) {
        return vec3f(1.0);
    }
    let albedo = environment.albedo;
    //#if BANDS
    let lining = in_channels(LINING);
    //#else
    let lining = LINING;
    //#end
    return open_with_bounces(open, lining * albedo) / max(open_with_bounces(open, colour * albedo), vec3f(1e-4));
}

// material: colour and part of the mouth; tongue: see Shade
fn mouth_at(point: Point, material: vec4f, tongue: array<vec4f, 2>) -> Surface {
    if (material.w == TONGUE) {
        return tongue_at(point, material.rgb, tongue);
    }
    return teeth_at(point, material.w);
}
