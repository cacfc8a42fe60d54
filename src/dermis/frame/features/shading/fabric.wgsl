// Cloth: relief and brightness of its threads, and small wrinkles, as functions of the position on the cloth.

//#fill const MM_PER_UV: f32 = {fabric_mm_per_uv};

const JERSEY: u32 = 1u; // weaves, in the order of mesh/fabric.py; 0 is no cloth, and 4 is rib
const PLAIN: u32 = 2u;
const TWILL: u32 = 3u;
const CLOTH_SPECULAR: f32 = 0.35; // strength of the surface lobe relative to a smooth dielectric: light is lost between fibres
const FINITE_STEP: f32 = 0.12; // of derivatives [threads]
const WEFT: vec3f = vec3f(0.52, 0.52, 0.50); // albedo of the undyed threads of twill
const FIBRE_MM: f32 = 1.7; // size of the variation of brightness by uneven fibres
const WRINKLE_MM: f32 = 13.0; // size of small wrinkles

fn lattice_value(cell: vec2i) -> f32 {
    var h = u32(cell.x) * 0x9E3779B9u + u32(cell.y) * 0x85EBCA6Bu;
    h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12u)) * 0x297A2D39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

// Smooth random value, 0 to 1.
fn cloth_noise(p: vec2f) -> f32 {
    let cell = vec2i(floor(p));
    let f = fract(p);
    let t = f * f * f * (f * (6.0 * f - 15.0) + 10.0);
    let low = mix(lattice_value(cell), lattice_value(cell + vec2i(1, 0)), t.x);
    let high = mix(lattice_value(cell + vec2i(0, 1)), lattice_value(cell + vec2i(1, 1)), t.x);
    return mix(low, high, t.y);
}

// Relative height of threads, 0 to 1, at a position in units of their distance.
fn thread_height(p: vec2f, weave: u32) -> f32 {
    if (weave == JERSEY) { // columns of V-shaped stitches
        let across = abs(fract(p.x) - 0.5);
        let row = fract(1.35 * p.y + 1.3 * across);
        return (1.0 - abs(2.0 * row - 1.0)) * sin(2.0 * PI * clamp(across, 0.02, 0.48)) * 0.6 + 0.4 * sin(2.0 * PI * across);
    }
    if (weave == PLAIN) {
        let uneven = p + 0.5 * vec2f(cloth_noise(0.13 * p.yx), cloth_noise(0.13 * p + 7.0));
        let parity = (i32(floor(uneven.x)) + i32(floor(uneven.y))) & 1;
        let bulge = abs(sin(PI * uneven));
        return select(bulge.x * sqrt(bulge.y), bulge.y * sqrt(bulge.x), parity == 0);
    }
    if (weave == TWILL) {
        return abs(sin(PI * (p.x + 0.55 * p.y))) * (0.8 + 0.2 * abs(sin(PI * 1.7 * p.y)));
    }
    return pow(abs(sin(PI * p.x)), 0.8); // rib
}

// Height of small wrinkles in units of WRINKLE_MM, at a position on the cloth.
fn wrinkle_height(mm: vec2f) -> f32 {
    let p = mm / WRINKLE_MM;
    let bent = p + 0.9 * vec2f(cloth_noise(0.5 * p + 3.0), cloth_noise(0.5 * p + 11.0));
    let ridge = 1.0 - abs(2.0 * cloth_noise(bent * vec2f(0.55, 1.0)) - 1.0);
    return ridge * ridge * smoothstep(0.35, 0.75, cloth_noise(0.21 * p + 5.0)) * 0.5;
}

// Surface of cloth, with the normal, the albedo and the roughness of threads and wrinkles.
// footprint : side of the filter in uv
fn cloth_at(point: Point, colour: vec3f, material: PartMaterial, footprint: f32) -> Surface {
    let mm = MM_PER_UV * point.uv;
    let p = mm / material.thread_mm;
    let seen = 1.0 - smoothstep(0.12, 0.4, footprint * MM_PER_UV / material.thread_mm);
    let height = thread_height(p, material.weave);
    let rise = vec2f(thread_height(p + vec2f(FINITE_STEP, 0.0), material.weave), thread_height(p + vec2f(0.0, FINITE_STEP), material.weave));
    var slope = seen * material.relief * clamp((rise - height) / FINITE_STEP, vec2f(-2.0), vec2f(2.0));
    let step = 0.07 * WRINKLE_MM;
    let low = wrinkle_height(mm);
    let high = vec2f(wrinkle_height(mm + vec2f(step, 0.0)), wrinkle_height(mm + vec2f(0.0, step)));
    slope += material.crumple * (high - low) / 0.07;
    let mixture = material.contrast * mix(0.35, 1.0 - height, seen);
    let fibres = 1.0 - smoothstep(0.12, 0.4, footprint * MM_PER_UV / FIBRE_MM);
    var albedo = colour * (1.0 - 0.5 * mixture);
    if (material.weave == TWILL) {
        //#if BANDS
        albedo = mix(colour, in_channels(WEFT), 0.55 * mixture);
        //#else
        albedo = mix(colour, WEFT, 0.55 * mixture);
        //#end
    }
    albedo *= 1.0 + 0.06 * fibres * (cloth_noise(mm / FIBRE_MM) - 0.5) + 0.04 * (cloth_noise(mm / 42.0) - 0.5);
    let hidden = (1.0 - seen) * material.relief * material.relief;
    let m = clamp(sqrt(pow(material.roughness, 4.0) + 0.5 * hidden), 0.05, 1.0);
    return Surface(bend(point, MM_PER_UV * slope), albedo, m, CLOTH_SPECULAR);
}
