// Bounding boxes with cones of normals, and a test whether translucent pairs are possible between two boxes.
//#include "translucency/translucent_pair.wgsl"
//#include "each.wgsl"
//#include "search.wgsl"

const FAR: f32 = 1e18; // coordinate of an empty box, whose squared distance is finite
const ROUNDING: f32 = 1e-5; // error of cosines

struct Bounds {
    low: vec3f,
    cosine: f32, // cosine and sine of the cone: the widest angle between the axis and a normal
    high: vec3f,
    sine: f32,
    axis: vec3f,
    occupied: u32,
}

fn empty_bounds() -> Bounds {
    return Bounds(vec3f(FAR), 1.0, vec3f(-FAR), 0.0, vec3f(0.0), 0u);
}

fn unit_or_zero(v: vec3f) -> vec3f {
    return v * inverseSqrt(max(dot(v, v), 1e-30));
}

// Bounds with the cosine of the cone of normals; without an axis the cone holds all directions.
fn with_cone(bounds: Bounds, cosine: f32) -> Bounds {
    var result = bounds;
    result.cosine = select(clamp(cosine, -1.0, 1.0), -1.0, dot(bounds.axis, bounds.axis) < 0.5);
    result.sine = sqrt(max(1.0 - result.cosine * result.cosine, 0.0));
    return result;
}

fn may_pair(a: Bounds, b: Bounds) -> bool {
    let gap = max(max(a.low - b.high, b.low - a.high), vec3f(0.0));
    return dot(gap, gap) < search.radius_mm * search.radius_mm && normals_may_oppose(a, b);
}

// Whether two normals of the cones may be far enough apart for a pair; both cones may widen the angle between the axes.
fn normals_may_oppose(a: Bounds, b: Bounds) -> bool {
    let limit = MAX_COSINE + TURN_MARGIN;
    let limit_sine = sqrt(1.0 - limit * limit);
    let cosine = a.cosine * b.cosine - a.sine * b.sine;
    let sine = a.sine * b.cosine + a.cosine * b.sine;
    let unbounded = min(min(a.cosine, b.cosine), cosine) <= limit;
    return unbounded || dot(a.axis, b.axis) <= limit * cosine + limit_sine * sine + ROUNDING;
}
