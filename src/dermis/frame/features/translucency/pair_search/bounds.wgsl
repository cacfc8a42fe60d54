// Boxes with cones of normals, and whether places in two of them may be translucent pairs.
//#include "translucency/translucent_pair.wgsl"
//#include "each.wgsl"
//#include "search.wgsl"

const FAR: f32 = 1e18; // the box of nothing, whose distance from others has a square
const ROUNDING: f32 = 1e-5; // of cosines

struct Bounds {
    low: vec3f,
    cosine: f32, // of the widest angle between the axis and a normal
    high: vec3f,
    sine: f32,
    axis: vec3f,
    any: u32,
}

fn nothing() -> Bounds {
    return Bounds(vec3f(FAR), 1.0, vec3f(-FAR), 0.0, vec3f(0.0), 0u);
}

fn unit_or_zero(v: vec3f) -> vec3f {
    return v * inverseSqrt(max(dot(v, v), 1e-30));
}

// With the cosine of its normals; without an axis they may point anywhere.
fn coned(bounds: Bounds, cosine: f32) -> Bounds {
    var made = bounds;
    made.cosine = select(clamp(cosine, -1.0, 1.0), -1.0, dot(bounds.axis, bounds.axis) < 0.5);
    made.sine = sqrt(max(1.0 - made.cosine * made.cosine, 0.0));
    return made;
}

fn may_pair(a: Bounds, b: Bounds) -> bool {
    let gap = max(max(a.low - b.high, b.low - a.high), vec3f(0.0));
    return dot(gap, gap) < search.radius_mm * search.radius_mm && may_face(a, b);
}

// Whether normals may be so far apart that a place counts: both cones may widen the angle between the axes.
fn may_face(a: Bounds, b: Bounds) -> bool {
    let limit = ASKEW + TURN;
    let across = sqrt(1.0 - limit * limit);
    let cosine = a.cosine * b.cosine - a.sine * b.sine;
    let sine = a.sine * b.cosine + a.cosine * b.sine;
    let wide = min(min(a.cosine, b.cosine), cosine) <= limit;
    return wide || dot(a.axis, b.axis) <= limit * cosine + across * sine + ROUNDING;
}
