// Where the surface goes on beyond the edges of charts: straight walks from triangle to triangle, each texel its own.
//#include "shape/geometry.wgsl"
//#include "each.wgsl"

override SIZE: u32; // texels along a side of the atlas

const NO_TRIANGLE: u32 = 0xffffffffu;
//#fill const INWARD: f32 = {inward}; // of the way to a place inside the triangle: so that a walk from a corner starts inside
//#fill const INNER: vec2f = vec2f({inner_b}, {inner_c}); // weights of its corners b and c: from the very middle, walks meet corners more often
const MOST_STEPS: u32 = 1024u;
const LEAST: f32 = 1e-12;
const LEAST_TURN: f32 = 0.05; // sine between the steps of u and v under which their mean means nothing

struct Walk {
    texel: u32, // x and y packed
    triangle: u32, // where it begins, on one of its sides, and the barycentric weights packed
    weights: u32,
    source: array<f32, 2>, // the texel's light if the walk leads nowhere [texel]
}

struct Beyond {
    source: vec2f, // where the light is [texel], whole numbers at texel centres
    texel: vec2u, // that shows it
}

// A triangle in its own plane, first corner at 0 and second to its right [mm].
struct Flat {
    b: vec2f,
    c: vec2f,
    right: vec3f,
    up: vec3f,
}

struct Found {
    triangle: u32, // NO_TRIANGLE where the surface ends
    weights: vec2f, // of the second and third corner
}

@group(0) @binding(30) var<storage, read> walks: array<Walk>;
@group(0) @binding(31) var<storage, read> sides: array<u32>; // of each side: triangle across << 3 | its side << 1 | whether it is turned
@group(0) @binding(32) var<storage, read_write> gutter: array<Beyond>;

fn cross2(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

fn unit_or_zero(v: vec3f) -> vec3f {
    return v / max(length(v), 1e-9);
}

fn flattened(triangle: u32) -> Flat {
    let t = triangle_at(triangle);
    let a = position_of(t.x);
    let first = position_of(t.y) - a;
    let second = position_of(t.z) - a;
    let right = unit_or_zero(first);
    let up = unit_or_zero(second - dot(second, right) * right);
    return Flat(vec2f(dot(first, right), 0.0), vec2f(dot(second, right), dot(second, up)), right, up);
}

fn corner_of_flat(flat: Flat, k: u32) -> vec2f {
    return select(select(flat.c, flat.b, k == 1u), vec2f(0.0), k == 0u);
}

// A direction of the surface laid into the triangle's plane without getting shorter.
fn laid(flat: Flat, direction: vec3f) -> vec2f {
    let along = vec2f(dot(direction, flat.right), dot(direction, flat.up));
    return along * length(direction) / max(length(along), LEAST);
}

// Steps for u and for v at a corner [mm per unit of uv]; those of the triangle where the corner's mean nothing.
fn steps_at(flat: Flat, corner: Corner, own: mat2x2f, mirrored: f32) -> mat2x2f {
    let steps = mat2x2f(laid(flat, corner.dpdu), laid(flat, corner.dpdv));
    let least = LEAST_TURN * length(corner.dpdu) * length(corner.dpdv);
    if (mirrored * determinant(steps) > -least) {
        return own;
    }
    return steps;
}

// The way on the surface from a place on a triangle's side to a texel beyond it [mm].
fn way_to(walk: Walk, flat: Flat, w: vec3f) -> vec2f {
    let t = triangle_at(walk.triangle);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let s = b.uv - a.uv;
    let r = c.uv - a.uv;
    let in_uv = cross2(s, r);
    let own = mat2x2f((r.y * flat.b - s.y * flat.c) / in_uv, (s.x * flat.c - r.x * flat.b) / in_uv);
    let mirrored = -sign(in_uv); // v runs down
    let steps = w.x * steps_at(flat, a, own, mirrored) + w.y * steps_at(flat, b, own, mirrored)
        + w.z * steps_at(flat, c, own, mirrored);
    let texel = vec2f(f32(walk.texel & 0xffffu), f32(walk.texel >> 16u));
    let off = texel + 0.5 - f32(SIZE) * place_of_point(walk.triangle, w);
    return steps * off / texels_per_uv(walk.triangle);
}

// Weights of b and c at a place t, none negative.
fn weights_at(a: vec2f, b: vec2f, c: vec2f, t: vec2f) -> vec2f {
    let area = cross2(b - a, c - a);
    let w = clamp(vec2f(cross2(t - a, c - a), cross2(b - a, t - a)) / area, vec2f(0.0), vec2f(1.0));
    return w / max(w.x + w.y, 1.0);
}

// Weights of the second and third corner, given those of the corners j + 1 and j + 2.
fn in_order(j: u32, w: vec2f) -> vec2f {
    let first = 1.0 - w.x - w.y;
    return select(select(vec2f(w.y, first), vec2f(first, w.x), j == 1u), w, j == 0u);
}

// Side through which the way from s to t leaves a triangle that s lies in, 3 if t lies in it too.
fn first_exit(flat: Flat, s: vec2f, t: vec2f) -> u32 {
    let d = t - s;
    for (var k = 0u; k < 3u; k++) {
        let a = corner_of_flat(flat, k);
        let b = corner_of_flat(flat, (k + 1u) % 3u);
        if (cross2(d, a - s) <= 0.0 && cross2(d, b - s) >= 0.0 && cross2(b - a, t - a) < 0.0) {
            return k;
        }
    }
    return 3u;
}

// Where the third corner of a triangle lies as seen from one of its sides: along it and to its left, in its lengths.
fn apex_of(triangle: u32, side: u32) -> vec2f {
    let flat = flattened(triangle);
    let start = corner_of_flat(flat, side);
    let along = corner_of_flat(flat, (side + 1u) % 3u) - start;
    let rest = corner_of_flat(flat, (side + 2u) % 3u) - start;
    return vec2f(dot(along, rest), cross2(along, rest)) / max(dot(along, along), 1e-18);
}

// The triangle in which the way from s, in a triangle, to t ends; all are unfolded into the first one's plane.
fn walked(triangle: u32, flat: Flat, s: vec2f, t: vec2f) -> Found {
    var k = first_exit(flat, s, t);
    if (k == 3u) {
        return Found(triangle, weights_at(vec2f(0.0), flat.b, flat.c, t));
    }
    let d = t - s;
    var f = triangle;
    var a = corner_of_flat(flat, k);
    var b = corner_of_flat(flat, (k + 1u) % 3u);
    var hand = 1.0;
    for (var n = 0u; n < MOST_STEPS; n++) {
        let word = sides[3u * f + k];
        if (word == NO_TRIANGLE) {
            break;
        }
        let g = word >> 3u;
        let j = (word >> 1u) & 3u;
        if ((word & 1u) == 1u) {
            hand = -hand;
        } else {
            let end = a;
            a = b;
            b = end;
        }
        // now a and b are where corners j and j + 1 of g come to lie
        let apex = apex_of(g, j);
        let side = b - a;
        let c = a + apex.x * side + hand * apex.y * vec2f(-side.y, side.x);
        var o = a;
        var p = b;
        var q = c;
        k = (j + 1u) % 3u;
        // out between the apex and the end on its other side
        if ((cross2(d, c - s) > 0.0) != (cross2(d, a - s) > 0.0)) {
            o = b;
            p = c;
            q = a;
            k = (j + 2u) % 3u;
        }
        let inner = cross2(q - p, o - p);
        if (inner != 0.0 && cross2(q - p, t - p) * inner >= 0.0) {
            return Found(g, in_order(j, weights_at(a, b, c, t)));
        }
        f = g;
        a = p;
        b = q;
    }
    return Found(NO_TRIANGLE, vec2f(0.0));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = number_of(group, groups, lane);
    if (index >= arrayLength(&walks)) {
        return;
    }
    let walk = walks[index];
    let second = unpack2x16unorm(walk.weights);
    let w = vec3f(1.0 - second.x - second.y, second);
    let flat = flattened(walk.triangle);
    let root = w.y * flat.b + w.z * flat.c;
    let start = root + INWARD * (INNER.x * flat.b + INNER.y * flat.c - root);
    let found = walked(walk.triangle, flat, start, root + way_to(walk, flat, w));
    var source = vec2f(walk.source[0], walk.source[1]);
    if (found.triangle != NO_TRIANGLE && (triangle_at(found.triangle).w & MAPPED) != 0u) {
        let there = vec3f(1.0 - found.weights.x - found.weights.y, found.weights);
        source = f32(SIZE) * place_of_point(found.triangle, there) - 0.5;
    }
    gutter[index] = Beyond(source, vec2u(walk.texel & 0xffffu, walk.texel >> 16u));
}
