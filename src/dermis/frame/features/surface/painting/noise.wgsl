// Solid noise from random numbers at lattice points, and scattered dots.

// Three random words of a lattice point. Source: [Jarzynski2020].
fn words_at(cell: vec3i, seed: u32) -> vec3u {
    var v = bitcast<vec3u>(cell) + vec3u(seed, seed * 747796405u, seed * 2891336453u);
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v ^= v >> vec3u(16u);
    v.x += v.y * v.z;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    return v;
}

fn fractions(words: vec3u) -> vec3f {
    return vec3f(words >> vec3u(8u)) * (1.0 / 16777216.0);
}

const MAX_NOISE: f32 = 2.1; // bound of the magnitude of gradient_noise

// Smooth noise of about -1 to 1 with features of one unit. Source: [Perlin2002], with gradients of any length.
fn gradient_noise(position: vec3f, seed: u32) -> f32 {
    let cell = floor(position);
    let near = position - cell;
    let fade = near * near * near * (near * (near * 6.0 - 15.0) + 10.0);
    var total = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let at = vec3f(vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u));
        let slope = 2.0 * fractions(words_at(vec3i(cell + at), seed)) - 1.0;
        let weight = mix(1.0 - fade, fade, at);
        total += weight.x * weight.y * weight.z * dot(slope, near - at);
    }
    return 1.4 * total;
}

// Fraction of the amplitude of noise that texels resolve: 0 for features below two texels, 1 above four.
fn visible(blob_mm: f32, texel_mm: f32) -> f32 {
    return saturate(0.5 * blob_mm / texel_mm - 1.0);
}

struct Dots {
    spacing_mm: f32,
    smallest: f32, // smallest and largest radius, relative to the spacing
    largest: f32,
    ragged_mm: f32,
}

// Sum of round soft dots, each 1 at its centre and fainter if the centre is off the surface. Source: [Worley1996] for points in the cells
// of a lattice.
// density : fraction of the dots that is visible, some of them faintly
fn dots(position_mm: vec3f, normal: vec3f, kind: Dots, density: f32, texel_mm: f32, seed: u32) -> f32 {
    let position = position_mm / kind.spacing_mm;
    let blur = 1.2 * texel_mm / kind.spacing_mm;
    let first = floor(position - 0.5);
    var total = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let cell = first + vec3f(vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u));
        let off = position - cell - fractions(words_at(vec3i(cell), seed));
        let away = dot(off, off);
        if (away < 0.25) {
            let one = fractions(words_at(vec3i(cell), seed + 1u));
            let above = dot(off, normal);
            let visibility = saturate(4.0 * (density - one.x) + density);
            let radius = mix(kind.smallest, kind.largest, one.y * one.y);
            let reach = min(radius * radius + blur * blur, 0.25);
            let beside = max(1.0 - (away - above * above) / reach, 0.0);
            let near = 1.0 - 4.0 * away;
            total += visibility * near * near * beside * beside * beside * radius * radius / reach;
        }
    }
    return min(total, 1.0);
}
