// Far-field scattering of a hair: a rough, absorbing dielectric cylinder. Sources: [Marschner2003; dEon2011; Chiang2016].

//#fill const HAIR_ETA: f32 = {hair_eta};
//#fill const HAIR_WIDTH: f32 = {hair_width}; // of the azimuthal logistic distribution [rad]
//#fill const HAIR_LOGISTIC_NORM: f32 = {hair_logistic_norm}; // normalisation of that distribution on (-pi, pi)
//#fill const HAIR_VARIANCE: f32 = {hair_variance}; // longitudinal, of the lobe R
//#fill const HAIR_TILT: f32 = {hair_tilt}; // of the scales of the cuticle [rad]
//#fill const HAIR_SAMPLES: u32 = {hair_samples}; // rays across the fibre

const HAIR_PI: f32 = 3.14159265358979;

// Fractions of light in the lobes R, TT, TRT and all further ones.
struct FibreTerms {
    reflected: f32,
    transmitted: vec3f,
    internal: vec3f,
    residual: vec3f,
}

// exp(-a) I0(a), with the polynomials of Abramowitz and Stegun.
fn scaled_bessel(a: f32) -> f32 {
    if (a < 3.75) {
        let t = a * a / 14.0625;
        let s = 1.2067492 + t * (0.2659732 + t * (0.0360768 + t * 0.0045813));
        return exp(-a) * (1.0 + t * (3.5156229 + t * (3.0899424 + t * s)));
    }
    let t = 3.75 / a;
    let u = 0.00916281 + t * (-0.02057706 + t * (0.02635537 + t * (-0.01647633 + t * 0.00392377)));
    return (0.39894228 + t * (0.01328592 + t * (0.00225319 + t * (-0.00157565 + t * u)))) / sqrt(a);
}

// Longitudinal scattering function of the sines of light and view along the fibre.
fn hair_longitudinal(sin_i: f32, sin_o: f32, v: f32) -> f32 {
    let a = sqrt(max(1.0 - sin_i * sin_i, 0.0) * max(1.0 - sin_o * sin_o, 0.0)) / v;
    return scaled_bessel(a) * exp(a - sin_i * sin_o / v - 1.0 / v) / (v * (1.0 - exp(-2.0 / v)));
}

fn hair_azimuthal(x: f32) -> f32 {
    let wrapped = abs(x - 2.0 * HAIR_PI * round(x / (2.0 * HAIR_PI)));
    let e = exp(-wrapped / HAIR_WIDTH);
    return e / (HAIR_WIDTH * (1.0 + e) * (1.0 + e)) * HAIR_LOGISTIC_NORM;
}

fn hair_fresnel(c: f32) -> f32 {
    let t = sqrt(1.0 - (1.0 - c * c) / (HAIR_ETA * HAIR_ETA));
    let parallel = (HAIR_ETA * c - t) / (HAIR_ETA * c + t);
    let across = (c - HAIR_ETA * t) / (c + HAIR_ETA * t);
    return 0.5 * (parallel * parallel + across * across);
}

// Fractions of light in each lobe; depth: absorption over a radius; h: offset of the ray across the fibre, -1 to 1
fn hair_fibre_terms(sin_o: f32, depth: vec3f, h: f32) -> FibreTerms {
    let cos_o = sqrt(max(1.0 - sin_o * sin_o, 1e-5));
    let inner = h * cos_o / sqrt(HAIR_ETA * HAIR_ETA - sin_o * sin_o);
    let path_length = 2.0 * sqrt(1.0 - inner * inner) / sqrt(1.0 - sin_o * sin_o / (HAIR_ETA * HAIR_ETA));
    let attenuation = exp(-depth * path_length);
    let f = hair_fresnel(cos_o * sqrt(1.0 - h * h));
    let transmitted = (1.0 - f) * (1.0 - f) * attenuation;
    let internal = transmitted * attenuation * f;
    return FibreTerms(f, transmitted, internal, internal * f * attenuation / (1.0 - f * attenuation));
}

fn hair_offset(k: u32) -> f32 {
    return (2.0 * f32(k) + 1.0) / f32(HAIR_SAMPLES) - 1.0;
}

// Means over the fibre's width: albedo of each lobe.
fn hair_albedo(sin_o: f32, depth: vec3f) -> FibreTerms {
    var mean = FibreTerms(0.0, vec3f(0.0), vec3f(0.0), vec3f(0.0));
    for (var k = 0u; k < HAIR_SAMPLES; k += 1u) {
        let one = hair_fibre_terms(sin_o, depth, hair_offset(k));
        mean.reflected += one.reflected / f32(HAIR_SAMPLES);
        mean.transmitted += one.transmitted / f32(HAIR_SAMPLES);
        mean.internal += one.internal / f32(HAIR_SAMPLES);
        mean.residual += one.residual / f32(HAIR_SAMPLES);
    }
    return mean;
}

// Sine of an angle changed by a multiple of the tilt of the scales.
fn hair_tilted(sine: f32, scales: f32) -> f32 {
    return sine * cos(scales * HAIR_TILT) + sqrt(max(1.0 - sine * sine, 0.0)) * sin(scales * HAIR_TILT);
}

// Arc sine that is more accurate than asin on some devices.
fn hair_asin(sine: f32) -> f32 {
    return atan2(sine, sqrt(1.0 - sine * sine));
}

// Radiance per irradiance of a plane that faces the light [1/sr].
// phi: azimuth between light and view
fn hair_scattered(sin_i: f32, sin_o: f32, phi: f32, depth: vec3f) -> vec3f {
    let cos_o = sqrt(max(1.0 - sin_o * sin_o, 1e-5));
    let along = vec4f(
        hair_longitudinal(sin_i, hair_tilted(sin_o, -2.0), HAIR_VARIANCE),
        hair_longitudinal(sin_i, hair_tilted(sin_o, 1.0), 0.25 * HAIR_VARIANCE),
        hair_longitudinal(sin_i, hair_tilted(sin_o, 4.0), 4.0 * HAIR_VARIANCE),
        hair_longitudinal(sin_i, sin_o, 4.0 * HAIR_VARIANCE),
    );
    var total = vec3f(0.0);
    for (var k = 0u; k < HAIR_SAMPLES; k += 1u) {
        let h = hair_offset(k);
        let one = hair_fibre_terms(sin_o, depth, h);
        let entry = hair_asin(h);
        let inner = hair_asin(h * cos_o / sqrt(HAIR_ETA * HAIR_ETA - sin_o * sin_o));
        total += vec3f(one.reflected * along.x * hair_azimuthal(phi + 2.0 * entry));
        total += one.transmitted * (along.y * hair_azimuthal(phi - (2.0 * inner - 2.0 * entry + HAIR_PI)));
        total += one.internal * (along.z * hair_azimuthal(phi - (4.0 * inner - 2.0 * entry + 2.0 * HAIR_PI)));
        total += one.residual * (along.w * 0.5 / HAIR_PI);
    }
    return total / f32(HAIR_SAMPLES);
}
