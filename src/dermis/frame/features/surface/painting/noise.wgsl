// Random textures in space, from random numbers at the points of a lattice, and scattered dots.

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

fn shares(words: vec3u) -> vec3f {
    return vec3f(words >> vec3u(8u)) * (1.0 / 16777216.0);
}

const MOST_NOISE: f32 = 2.1; // which all that follows stays below

// Smooth noise of about -1 to 1, its blobs one unit large. Source: [Perlin2002], with directions of any length.
fn gradient_noise(place: vec3f, seed: u32) -> f32 {
    let cell = floor(place);
    let near = place - cell;
    let fade = near * near * near * (near * (near * 6.0 - 15.0) + 10.0);
    var total = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let at = vec3f(vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u));
        let slope = 2.0 * shares(words_at(vec3i(cell + at), seed)) - 1.0;
        let weight = mix(1.0 - fade, fade, at);
        total += weight.x * weight.y * weight.z * dot(slope, near - at);
    }
    return 1.4 * total;
}

// How much of noise with blobs of this size texels can show: none under two texels, all over four.
fn visible(blob_mm: f32, texel_mm: f32) -> f32 {
    return saturate(0.5 * blob_mm / texel_mm - 1.0);
}

struct Dots {
    spacing_mm: f32,
    smallest: f32, // radius [of the spacing]
    largest: f32,
    ragged_mm: f32,
}

// Round soft dots, 1 at the middle of one: round in the surface, faint where their middle lies off it. Source:
// [Worley1996] for points in the cells of a lattice.
// kept: share of them that is shown, some of them faintly
fn dots(place_mm: vec3f, normal: vec3f, kind: Dots, kept: f32, texel_mm: f32, seed: u32) -> f32 {
    let place = place_mm / kind.spacing_mm;
    let blur = 1.2 * texel_mm / kind.spacing_mm;
    let first = floor(place - 0.5);
    var total = 0.0;
    for (var corner = 0u; corner < 8u; corner++) {
        let cell = first + vec3f(vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u));
        let off = place - cell - shares(words_at(vec3i(cell), seed));
        let away = dot(off, off);
        if (away < 0.25) {
            let one = shares(words_at(vec3i(cell), seed + 1u));
            let above = dot(off, normal);
            let shown = saturate(4.0 * (kept - one.x) + kept);
            let radius = mix(kind.smallest, kind.largest, one.y * one.y);
            let reach = min(radius * radius + blur * blur, 0.25);
            let beside = max(1.0 - (away - above * above) / reach, 0.0);
            let near = 1.0 - 4.0 * away;
            total += shown * near * near * beside * beside * beside * radius * radius / reach;
        }
    }
    return min(total, 1.0);
}
