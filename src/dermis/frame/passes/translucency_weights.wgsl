// How much light passes through the flesh between translucent pairs, beyond what blurs carry along the surface.

struct Weighing {
    radius_mm: f32, // pairs are nearer than this
    before_mm2: f32, // variance that the sources' light has already
    cell_mm2: f32, // usual area of a source
    grain: f32, // least variance added, over the larger of that and the source's own area: it hides the sources' pattern
    count: u32,
    gaussian: array<vec4f, 24>, // weight per channel, variance [mm^2]
}

@group(0) @binding(0) var<uniform> weighing: Weighing;
@group(0) @binding(1) var<storage, read> pairs: array<u32>; // three words: source; depth, aside; along, share
@group(0) @binding(2) var<storage, read> sources: array<vec2u>; // texel; area [mm^2]
@group(0) @binding(3) var<storage, read_write> weights: array<vec2u>; // source; share of its light, as `encoded` packs it

const ROW: u32 = 1024u; // pairs in a row of invocations
const PI: f32 = 3.14159265358979;
const FAR_MM: f32 = 1e6; // as good as infinite
const LEAST_DISC: f32 = 0.3; // least share of a Gaussian within the radius that is scaled up to all of it

// Three shares with one exponent: nine bits each and five.
fn encoded(c: vec3f) -> u32 {
    let most = max(c.r, max(c.g, c.b));
    if (most < exp2(-24.0)) {
        return 0u;
    }
    let e = clamp(i32(floor(log2(most))) + 16, 0, 31);
    let m = min(vec3u(round(c * exp2(f32(24 - e)))), vec3u(511u));
    return m.r | (m.g << 9u) | (m.b << 18u) | (u32(e) << 27u);
}

// A Gaussian of the distance sqrt(t^2 + r^2) is exp(-t^2 / 2v) G(v, r) [dEonLuebke2007]; variance that the sources' light
// already has is not added again. The share that the blur along the surface carries is subtracted.
fn passed(depth: f32, aside: f32, along: f32, area: f32) -> vec3f {
    let edge2 = max(weighing.radius_mm * weighing.radius_mm - depth * depth, 0.0);
    var sum = vec3f(0.0);
    for (var k = 0u; k < weighing.count; k++) {
        let gaussian = weighing.gaussian[k];
        let w = max(gaussian.w - weighing.before_mm2, weighing.grain * max(area, weighing.cell_mm2));
        let disc = max(1.0 - exp(-0.5 * edge2 / w), LEAST_DISC);
        let straight = exp(-0.5 * (depth * depth / gaussian.w + aside * aside / w)) / disc;
        sum += gaussian.rgb * max(0.0, straight - exp(-0.5 * along * along / w)) / w;
    }
    return area / (2.0 * PI) * sum;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (id.x >= ROW || index >= arrayLength(&weights)) {
        return;
    }
    let source = pairs[3u * index];
    let across = unpack2x16unorm(pairs[3u * index + 1u]) * weighing.radius_mm;
    let rest = unpack2x16unorm(pairs[3u * index + 2u]);
    var along = weighing.radius_mm * rest.x;
    if (rest.x == 1.0) {
        along = FAR_MM; // no blur gets there
    }
    let share = rest.y * passed(across.x, across.y, along, bitcast<f32>(sources[source].y));
    weights[index] = vec2u(source, encoded(share));
}
