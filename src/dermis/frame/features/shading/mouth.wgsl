// Teeth, gums and tongue: single teeth along the arch, darker between, translucent where they bite.
//#include "eye.wgsl"

//#fill const ARCH_MM: f32 = {arch_mm};
//#fill const CROWN_MM: f32 = {crown_mm};
//#fill const BITE: f32 = {bite};
//#fill const MIDDLE: f32 = {middle};

const UPPER_TEETH: f32 = 1.0; // what a material's colour has behind it; 2 for lower teeth
const TONGUE: f32 = 3.0;
const TEETH: u32 = 7u; // of half an arch
// Widths of usual teeth from the middle on [mm].
const UPPER_MM: array<f32, TEETH> = array<f32, TEETH>(8.6, 6.6, 7.6, 7.1, 6.8, 10.2, 9.6);
const LOWER_MM: array<f32, TEETH> = array<f32, TEETH>(5.4, 5.9, 6.9, 7.0, 7.2, 11.2, 10.5);
// Artist's values, linear.
const CROWN: f32 = 9.8; // height that is seen of a tooth [mm]
const BULGE_MM: f32 = 0.55;
const ENAMEL: vec3f = vec3f(0.60, 0.54, 0.44);
const NECK: vec3f = vec3f(0.56, 0.45, 0.31);
const CLEAR_EDGE: vec3f = vec3f(0.36, 0.38, 0.40);
const GUM: vec3f = vec3f(0.42, 0.15, 0.14);
const SALIVA: f32 = 0.12; // roughness of what is wet here
const MOUTH_SCATTERED: vec3f = vec3f(0.04, 0.014, 0.008); // share of a light that comes in through cheeks and lips, some 8 mm

fn tooth_width(kind: f32, index: u32) -> f32 {
    return select(LOWER_MM[index], UPPER_MM[index], kind == UPPER_TEETH);
}

fn teeth_at(point: Point, kind: f32) -> Surface {
    let along = abs(point.uv.x - MIDDLE) * ARCH_MM;
    let height = (point.uv.y - BITE) * CROWN_MM;
    var index = 0u;
    var first = 0.0;
    loop {
        if (index + 1u >= TEETH || along < first + tooth_width(kind, index)) {
            break;
        }
        first += tooth_width(kind, index);
        index++;
    }
    let width = tooth_width(kind, index);
    let side = clamp(2.0 * (along - first) / width - 1.0, -1.0, 1.0); // from one neighbour to the next
    let between = 0.5 * width * (1.0 - abs(side)); // [mm]
    let crown = CROWN - 1.4 * pow(abs(side), 3.0) - 0.18 * f32(index);
    let gum = smoothstep(-0.25, 0.25, height - crown);
    let gap = smoothstep(0.02, 0.30 + 0.5 * (1.0 - smoothstep(0.0, 1.8, height)), between);
    var colour = mix(ENAMEL, NECK, smoothstep(0.45, 1.0, height / crown));
    colour = mix(CLEAR_EDGE, colour, smoothstep(0.0, 2.0, height));
    colour = mix(colour * mix(0.16, 1.0, gap), GUM * mix(0.75, 1.0, gap), gum);
    let slope = -4.0 * BULGE_MM * side / width * (1.0 - gum) * sign(point.uv.x - MIDDLE);
    return Surface(bend(point, vec2f(slope * ARCH_MM, 0.0)), colour, SALIVA, 1.0);
}

fn tongue_at(point: Point, colour: vec3f) -> Surface {
    let rough = eye_noise(1.1 * point.position.xz, 1.0) + 0.5 * eye_noise(2.7 * point.position.xz, 2.0);
    return Surface(point.normal, colour * (0.75 + 0.35 * rough), 0.25, 1.0);
}

// material: colour, and which part of the mouth
fn mouth_at(point: Point, material: vec4f) -> Surface {
    if (material.w == TONGUE) {
        return tongue_at(point, material.rgb);
    }
    return teeth_at(point, material.w);
}
