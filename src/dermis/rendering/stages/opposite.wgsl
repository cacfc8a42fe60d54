// What lies opposite each place of the surface through the flesh: how much of a Gaussian reaches it, where, and how near
// the rim is.
//#include "geometry.wgsl"
//#include "axes.wgsl"
//#include "normal_distribution.wgsl"

struct Grid {
    low: vec3f, // corner of the first cell [mm]
    cell_mm: f32,
    size: vec4u, // cells along x, y, z
    limit_mm: f32, // nothing beyond is looked for
    sigma_mm: f32, // standard deviation of the Gaussian by which thickness and rim are judged
    side: u32, // of the map that is made
}

struct Hit {
    t: f32, // [mm]
    triangle: u32, // NONE without one
    w: vec2f, // weights of the second and third corner
    enters: bool, // the flesh, or leaves it
}

// Means over what a Gaussian around a place sees opposite.
struct Beneath {
    share: f32, // of the Gaussian
    beyond: f32, // share of it that lies beyond the rim
    depth: f32, // under the tangent plane [mm]
    to: vec3f, // where, from the place [mm]
    normal: vec3f,
    best: Hit, // the one that lets most through
}

@group(1) @binding(0) var<uniform> grid: Grid;
@group(1) @binding(1) var<storage, read> first: array<u32>; // where each cell's triangles begin in the list
@group(1) @binding(2) var<storage, read> listed: array<u32>;
@group(1) @binding(3) var atlas: texture_2d<u32>; // triangle + 1, two barycentric weights packed
@group(1) @binding(4) var<storage, read> normals: array<vec4f>; // of the vertices, smoothed
@group(1) @binding(5) var opposite: texture_storage_2d<rgba32uint, write>; // as transmission.wgsl reads it

const NONE: u32 = 0xffffffffu;
const PI: f32 = 3.14159265358979;
const GOLDEN: f32 = 2.39996322972865; // angle [rad]
const THICK_MM: f32 = 1e6; // as good as without end
const RAYS: u32 = 64u; // by which a Gaussian is felt
const FEW: u32 = 8u; // of them tell whether there is anything at all
const RAISED: f32 = 0.1; // standard deviations above the tangent plane that rays begin: the surface may be curved
const FLESH: f32 = 4.0; // times the limit without a surface is air and not deep flesh
const SLACK: f32 = 1e-5; // covers rounding, so that no ray slips through between two triangles
const MOST_CELLS: u32 = 512u; // that a ray is followed through
const ASTRAY: f32 = 1.5; // times as far as the mean: a ray that found something else
const LEAST_FACING: f32 = 0.7; // cosine under which what lies opposite is rather a side

// Where a ray meets a triangle, if it does so before `best` [MollerTrumbore1997].
fn meet(o: vec3f, d: vec3f, index: u32, best: Hit, entering: bool) -> Hit {
    let t = triangle_at(index);
    let a = position_of(t.x);
    let e1 = position_of(t.y) - a;
    let e2 = position_of(t.z) - a;
    let p = cross(d, e2);
    let det = dot(e1, p);
    if (det == 0.0 || (det > 0.0 && !entering)) {
        return best;
    }
    let s = o - a;
    let u = dot(s, p) / det;
    let q = cross(s, e1);
    let v = dot(d, q) / det;
    let far = dot(e2, q) / det;
    if (min(u, v) < -SLACK || u + v > 1.0 + SLACK || far < 0.0 || far >= best.t) {
        return best;
    }
    return Hit(far, index, vec2f(u, v), det > 0.0);
}

// The nearest place where a ray leaves the flesh, or also enters it, cell by cell [AmanatidesWoo1987].
fn first_hit(o: vec3f, d: vec3f, limit_mm: f32, entering: bool) -> Hit {
    var hit = Hit(limit_mm, NONE, vec2f(0.0), false);
    let start = (o - grid.low) / grid.cell_mm;
    var cell = vec3i(floor(start));
    let way = select(d, vec3f(1e-9), abs(d) < vec3f(1e-9));
    let step = vec3i(sign(way));
    let across = abs(grid.cell_mm / way);
    var border = (vec3f(cell + max(step, vec3i(0))) - start) * grid.cell_mm / way;
    for (var cells = 0u; cells < MOST_CELLS; cells++) {
        if (all(cell >= vec3i(0)) && all(cell < vec3i(grid.size.xyz))) {
            let index = u32(cell.x) + grid.size.x * (u32(cell.y) + grid.size.y * u32(cell.z));
            for (var i = first[index]; i < first[index + 1u]; i++) {
                hit = meet(o, d, listed[i], hit, entering);
            }
        }
        let nearest = min(border.x, min(border.y, border.z));
        if (nearest >= hit.t) {
            break;
        }
        let axis = select(select(2, 1, border.y == nearest), 0, border.x == nearest);
        cell[axis] += step[axis];
        border[axis] += across[axis];
    }
    return hit;
}

fn first_exit(o: vec3f, d: vec3f) -> Hit {
    return first_hit(o, d, grid.limit_mm, false);
}

// One of many places around a point that are spread like the Gaussian; share: of it that lies nearer.
fn spread_to(axes: mat2x3f, index: u32, share: f32) -> vec3f {
    let far = grid.sigma_mm * sqrt(-2.0 * log(1.0 - share));
    return axes * (far * vec2f(cos(GOLDEN * f32(index)), sin(GOLDEN * f32(index))));
}

fn normal_at(t: vec4u, w: vec2f) -> vec3f {
    return normalize((1.0 - w.x - w.y) * normals[t.x] + w.x * normals[t.y] + w.y * normals[t.z]).xyz;
}

// A Gaussian of the straight distance is one over the tangent plane times one of the depth: so rays straight down from
// places spread by the former feel what the latter leaves.
fn look_beneath(p: vec3f, n: vec3f) -> Beneath {
    var seen = Beneath(0.0, 0.0, 0.0, vec3f(0.0), vec3f(0.0), Hit(grid.limit_mm, NONE, vec2f(0.0), false));
    var most = 0.0;
    let axes = beside(n);
    for (var i = 0u; i < RAYS; i++) {
        if (i == FEW && seen.share == 0.0) {
            break;
        }
        // The radical inverse makes the first few a spread of their own.
        let aside = spread_to(axes, i, f32(reverseBits(i)) * exp2(-32.0) + 0.5 / f32(RAYS));
        let raised = RAISED * grid.sigma_mm;
        let hit = first_exit(p + aside + raised * n, -n);
        if (hit.triangle == NONE) {
            seen.beyond += select(0.0, 1.0, is_beyond(p + aside + grid.sigma_mm * n, -n)) / f32(RAYS);
            continue;
        }
        let t = triangle_at(hit.triangle);
        let normal = normal_at(t, hit.w);
        let facing = -dot(n, normal);
        if (facing > 0.0 && (t.w & MAPPED) != 0u) {
            let depth = hit.t - raised;
            let scaled = depth / grid.sigma_mm;
            let weight = exp(-0.5 * scaled * scaled) / max(facing, LEAST_FACING);
            seen.share += weight;
            seen.depth += weight * depth;
            seen.to += weight * (aside - depth * n);
            seen.normal += weight * normal;
            if (weight > most) {
                most = weight;
                seen.best = hit;
            }
        }
    }
    let sum = max(seen.share, 1e-30);
    seen.share /= f32(RAYS);
    seen.depth /= sum;
    seen.to /= sum;
    seen.normal = normalize(seen.normal + 1e-30);
    return seen;
}

// Whether there is flesh under a place over the tangent plane: beyond a rim there is none, or only that of something else.
fn is_beyond(above: vec3f, down: vec3f) -> bool {
    let hit = first_hit(above, down, FLESH * grid.limit_mm, true);
    return hit.triangle == NONE || (hit.enters && hit.t > grid.limit_mm);
}

// The thickness of a slab that would let as much of the Gaussian through, as near the rim; where it is thin the share
// does not tell it well, and it is at least the distance of the tangent plane there.
fn thickness(beneath: Beneath, facing: f32) -> f32 {
    let passed = min(1.0, beneath.share / (1.0 - beneath.beyond));
    return max(grid.sigma_mm * sqrt(-2.0 * log(passed)), facing * beneath.depth);
}

// Where a ray towards the mean place leaves, which moves smoothly with p; if it misses, the best of those that were found.
fn middle_of(p: vec3f, beneath: Beneath) -> Hit {
    let far = length(beneath.to);
    let hit = first_exit(p, beneath.to / far);
    if (hit.triangle == NONE || hit.t > ASTRAY * far || (triangle_at(hit.triangle).w & MAPPED) == 0u) {
        return beneath.best;
    }
    return hit;
}

fn store(at: vec2u, place: vec2f, shape: vec3f) {
    textureStore(opposite, at, vec4u(pack2x16unorm(place), bitcast<vec3u>(shape)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(grid.side))) {
        return;
    }
    let at = vec2u((vec2f(id.xy) + 0.5) * vec2f(textureDimensions(atlas)) / f32(grid.side));
    let texel = textureLoad(atlas, at, 0);
    if (texel.x == 0u) {
        store(id.xy, vec2f(0.0), vec3f(-1.0)); // no surface
        return;
    }
    let w = unpack2x16unorm(texel.y);
    let t = triangle_at(texel.x - 1u);
    let a = position_of(t.x);
    let p = a + w.x * (position_of(t.y) - a) + w.y * (position_of(t.z) - a);
    let n = normal_at(t, w);
    let beneath = look_beneath(p, n);
    store(id.xy, vec2f(0.0), vec3f(THICK_MM));
    if (beneath.share == 0.0) {
        return;
    }
    let hit = middle_of(p, beneath);
    let facing = max(-dot(n, beneath.normal), 0.0);
    let rim = grid.sigma_mm * distance_of(beneath.beyond);
    let place = place_of_point(hit.triangle, vec3f(1.0 - hit.w.x - hit.w.y, hit.w));
    store(id.xy, place, vec3f(thickness(beneath, facing), rim, facing * rim));
}
