// Finds the source of each gutter texel: follows a straight path over the surface, from triangle to triangle, which starts at
// the edge of the chart.
//#include "shape/geometry.wgsl"
//#include "each.wgsl"

override SIZE: u32; // texels along a side of the atlas

const NO_TRIANGLE: u32 = 0xffffffffu;
//#fill const INWARD: f32 = {inward}; // fraction of the distance to an inner point by which paths from a corner start inside
//#fill const INNER: vec2f = vec2f({inner_b}, {inner_c}); // weights of b and c at the inner point; off centre, as paths from there hit fewer corners
const MAX_STEPS: u32 = 1024u;
const EPSILON: f32 = 1e-12;
const MIN_SINE: f32 = 0.05; // least sine between the steps of u and v at a corner; below it, the steps of the triangle are used

struct Start {
    texel: u32, // x and y packed
    triangle: u32, // triangle of the start, which lies on one of its sides
    weights: u32, // barycentric weights of the start, packed
    source: array<f32, 2>, // source of the texel if the path leaves the surface [texels]
}

struct GutterTexel {
    source: vec2f, // position whose light is copied [texels]; integers are texel centres
    texel: vec2u,
}

// A triangle in its own plane: the first corner is at 0, the second to the right of it [mm].
struct Flat {
    b: vec2f,
    c: vec2f,
    right: vec3f,
    up: vec3f,
}

struct End {
    triangle: u32, // NO_TRIANGLE where the surface ends
    weights: vec2f, // of the second and third corner
}

@group(0) @binding(30) var<storage, read> starts: array<Start>;
@group(0) @binding(31) var<storage, read> sides: array<u32>; // of each side: triangle across << 3 | its side << 1 | 1 if it has the opposite winding
@group(0) @binding(32) var<storage, read_write> gutter: array<GutterTexel>;

fn cross2(a: vec2f, b: vec2f) -> f32 {
    return a.x * b.y - a.y * b.x;
}

fn unit_or_zero(v: vec3f) -> vec3f {
    return v / max(length(v), 1e-9);
}

fn flatten(triangle: u32) -> Flat {
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

// A direction of the surface projected onto the triangle's plane, with its length preserved.
fn project_to_plane(flat: Flat, direction: vec3f) -> vec2f {
    let along = vec2f(dot(direction, flat.right), dot(direction, flat.up));
    return along * length(direction) / max(length(along), EPSILON);
}

// Steps for u and for v at a corner [mm per unit of uv]; the steps of the triangle, `own`, where these are degenerate.
fn steps_at(flat: Flat, corner: Corner, own: mat2x2f, mirrored: f32) -> mat2x2f {
    let steps = mat2x2f(project_to_plane(flat, corner.dpdu), project_to_plane(flat, corner.dpdv));
    let least = MIN_SINE * length(corner.dpdu) * length(corner.dpdv);
    if (mirrored * determinant(steps) > -least) {
        return own;
    }
    return steps;
}

// Vector on the surface from a point on a triangle's side to a texel beyond it [mm].
fn vector_to_texel(path: Start, flat: Flat, w: vec3f) -> vec2f {
    let t = triangle_at(path.triangle);
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
    let texel = vec2f(f32(path.texel & 0xffffu), f32(path.texel >> 16u));
    let off = texel + 0.5 - f32(SIZE) * atlas_position(path.triangle, w);
    return steps * off / texels_per_uv(path.triangle);
}

// Weights of b and c at a point t, clamped to the triangle.
fn weights_at(a: vec2f, b: vec2f, c: vec2f, t: vec2f) -> vec2f {
    let area = cross2(b - a, c - a);
    let w = clamp(vec2f(cross2(t - a, c - a), cross2(b - a, t - a)) / area, vec2f(0.0), vec2f(1.0));
    return w / max(w.x + w.y, 1.0);
}

// Weights of the second and third corner, from the weights w of the corners j + 1 and j + 2.
fn in_order(j: u32, w: vec2f) -> vec2f {
    let first = 1.0 - w.x - w.y;
    return select(select(vec2f(w.y, first), vec2f(first, w.x), j == 1u), w, j == 0u);
}

// Side through which the path from s to t leaves the triangle that contains s, 3 if t is inside too.
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

// Position of a triangle's third corner relative to one of its sides: along and to the left of it, in lengths of the side.
fn apex_of(triangle: u32, side: u32) -> vec2f {
    let flat = flatten(triangle);
    let start = corner_of_flat(flat, side);
    let along = corner_of_flat(flat, (side + 1u) % 3u) - start;
    let rest = corner_of_flat(flat, (side + 2u) % 3u) - start;
    return vec2f(dot(along, rest), cross2(along, rest)) / max(dot(along, along), 1e-18);
}

// The triangle in which the path from s to t ends; triangles are unfolded into the plane of the first one.
fn trace(triangle: u32, flat: Flat, s: vec2f, t: vec2f) -> End {
    var k = first_exit(flat, s, t);
    if (k == 3u) {
        return End(triangle, weights_at(vec2f(0.0), flat.b, flat.c, t));
    }
    let d = t - s;
    var f = triangle;
    var a = corner_of_flat(flat, k);
    var b = corner_of_flat(flat, (k + 1u) % 3u);
    var hand = 1.0;
    for (var n = 0u; n < MAX_STEPS; n++) {
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
        // a and b now are the unfolded corners j and j + 1 of g
        let apex = apex_of(g, j);
        let side = b - a;
        let c = a + apex.x * side + hand * apex.y * vec2f(-side.y, side.x);
        var o = a;
        var p = b;
        var q = c;
        k = (j + 1u) % 3u;
        // exit between the apex and the other end of the side
        if ((cross2(d, c - s) > 0.0) != (cross2(d, a - s) > 0.0)) {
            o = b;
            p = c;
            q = a;
            k = (j + 2u) % 3u;
        }
        let inner = cross2(q - p, o - p);
        if (inner != 0.0 && cross2(q - p, t - p) * inner >= 0.0) {
            return End(g, in_order(j, weights_at(a, b, c, t)));
        }
        f = g;
        a = p;
        b = q;
    }
    return End(NO_TRIANGLE, vec2f(0.0));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let index = list_index(group, groups, lane);
    if (index >= arrayLength(&starts)) {
        return;
    }
    let path = starts[index];
    let second = unpack2x16unorm(path.weights);
    let w = vec3f(1.0 - second.x - second.y, second);
    let flat = flatten(path.triangle);
    let root = w.y * flat.b + w.z * flat.c;
    let start = root + INWARD * (INNER.x * flat.b + INNER.y * flat.c - root);
    let end = trace(path.triangle, flat, start, root + vector_to_texel(path, flat, w));
    var source = vec2f(path.source[0], path.source[1]);
    if (end.triangle != NO_TRIANGLE && (triangle_at(end.triangle).w & MAPPED) != 0u) {
        let weights = vec3f(1.0 - end.weights.x - end.weights.y, end.weights);
        source = f32(SIZE) * atlas_position(end.triangle, weights) - 0.5;
    }
    gutter[index] = GutterTexel(source, vec2u(path.texel & 0xffffu, path.texel >> 16u));
}
