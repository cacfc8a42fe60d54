// How much light passes through the flesh between translucent pairs, beyond what the blurs carry round.
//#include "translucent_pair.wgsl"
//#include "packed_pair.wgsl"

override COUNT: u32 = 8u; // Gaussians; as a constant, so that software adapters unroll the loop
override SLABS: bool = false; // whether a table says what passes each thickness; else a Gaussian of the straight distance does

const ROWS: u32 = 32u; // of the table, as in optics/thin_parts.py

struct Weighing {
    radius_mm: f32, // pairs are nearer
    before_mm2: f32, // variance that the sources' light has already
    cell_mm2: f32, // that a source usually stands for
    grain: f32, // least variance that is added, over that or the source's own area: it hides their pattern
    reach_mm: f32, // thickness of the table's last row
    gaussian: array<vec4f, 24>, // weight per channel of what the blurs bring, variance [mm^2]
}

@group(0) @binding(0) var<uniform> weighing: Weighing;
@group(0) @binding(1) var<storage, read> pairs: array<u32>; // three words: source, receiver, offset in the map [1/8 texel]
@group(0) @binding(2) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(3) var<storage, read> source_points: array<Source>;
@group(0) @binding(4) var<storage, read_write> weights: array<vec2u>; // source and depth as in packed_pair.wgsl; share of its light, as encoded says
// Weights of what passes: COUNT of each row, evenly spaced by the root of the thickness; the first's w: how deep it is, as
// pair_word takes it. Not among the uniforms, where invocations that read different rows would take turns.
@group(0) @binding(5) var<storage, read> passing: array<vec4f>;

const ROW: u32 = 1024u; // of the pairs, as they are spread over invocations
const PI: f32 = 3.14159265358979;
const FINE: f32 = 8.0; // parts of a texel
const FAR_MM2: f32 = 1e12; // as good as without end
const LEAST_DISC: f32 = 0.3; // share of a Gaussian that the ball around a place must hold to stand for all of it

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

// The square of the distance along the surface to a place in the map [mm^2].
fn along2_of(offset: u32, metric: vec3f, area: f32) -> f32 {
    let by = vec2f(f32(bitcast<i32>(offset << 16u) >> 16u), f32(bitcast<i32>(offset) >> 16u));
    let square = dot(metric, vec3f(by * by, 2.0 * by.x * by.y)) / (FINE * FINE);
    return select(square + area / 6.0, FAR_MM2, offset == NOWHERE || square >= weighing.radius_mm * weighing.radius_mm);
}

// Weight of a Gaussian in what passes a thickness.
fn through(k: u32, row: f32) -> vec3f {
    let low = min(u32(row), ROWS - 2u);
    let near = passing[low * COUNT + k].rgb;
    return mix(near, passing[(low + 1u) * COUNT + k].rgb, row - f32(low));
}

fn row_of(depth2: f32) -> f32 {
    return f32(ROWS - 1u) * sqrt(min(sqrt(depth2) / weighing.reach_mm, 1.0));
}

fn deep_at(depth2: f32) -> f32 {
    let row = row_of(depth2);
    let low = min(u32(row), ROWS - 2u);
    return mix(passing[low * COUNT].w, passing[(low + 1u) * COUNT].w, row - f32(low));
}

// A Gaussian of the distance sqrt(t^2 + r^2) is exp(-t^2 / 2v) G(v, r) [dEonLuebke2007]; what is already in the sources'
// light need not be added. The blur along the surface has brought its own share: that is taken off.
fn passed(depth2: f32, aside2: f32, along2: f32, area: f32) -> vec3f {
    let edge2 = max(weighing.radius_mm * weighing.radius_mm - depth2, 0.0);
    let row = row_of(depth2);
    var sum = vec3f(0.0);
    for (var k = 0u; k < COUNT; k++) {
        let gaussian = weighing.gaussian[k];
        let w = max(gaussian.w - weighing.before_mm2, weighing.grain * max(area, weighing.cell_mm2));
        let disc = max(1.0 - exp(-0.5 * edge2 / w), LEAST_DISC);
        let along = exp(-0.5 * along2 / w);
        if (SLABS) {
            sum += (through(k, row) * (exp(-0.5 * aside2 / w) / disc)) / w;
        } else {
            let straight = exp(-0.5 * (depth2 / gaussian.w + aside2 / w)) / disc;
            sum += gaussian.rgb * max(0.0, straight - along) / w;
        }
    }
    return area / (2.0 * PI) * max(sum, vec3f(0.0));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (index >= arrayLength(&weights)) {
        return;
    }
    let number = pairs[3u * index];
    let receiver = receiver_points[pairs[3u * index + 1u]];
    let source = source_points[number];
    let lie = lie_of(receiver.position, receiver.normal, source);
    let near = lie.square < weighing.radius_mm * weighing.radius_mm;
    let share = select(0.0, share_of(lie.cosine, lie.inward), near);
    let depth2 = lie.depth * lie.depth;
    let along2 = along2_of(pairs[3u * index + 2u], receiver.metric, source.area);
    let light = passed(depth2, max(lie.square - depth2, 0.0), along2, source.area);
    var deep = 0.0;
    if (SLABS) {
        deep = deep_at(depth2);
    }
    weights[index] = vec2u(pair_word(number, deep), encoded(share * light));
}
