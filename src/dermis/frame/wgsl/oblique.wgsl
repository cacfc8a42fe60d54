// Light that enters at a slant goes on along its way before it scatters, and comes back from around a place beside where it
// entered: a point is lit as the surface is that far towards the light. Source: [WangJacques1995].
//#include "lights.wgsl"

override OBLIQUE: bool = false; // whether passes tell how the surface goes on beside a point

// Ways along the surface to two places beside a point [mm], and by how much the normal turns there; 0 where it ends.
struct GoesOn {
    way_u: vec3f,
    way_v: vec3f,
    turn_u: vec3f,
    turn_v: vec3f,
}

var<private> goes_on: GoesOn;

const LEAST_APART: f32 = 1e-4; // of the square of the sine between the two ways

// A point as light from one direction meets it.
struct MetByLight {
    point: Point,
    normal: vec3f, // with the relief
}

// What light from a direction meets that comes back around a point. Light that is finer than this way, as a laser's, mostly
// comes back from where it entered, and so stays.
fn met_by(light: Light, point: Point, normal: vec3f, l: vec3f) -> MetByLight {
    if (!OBLIQUE || light.sheet != 0u) {
        return MetByLight(point, normal);
    }
    let way = skin.aside_mm * (l - dot(l, point.normal) * point.normal);
    let uu = dot(goes_on.way_u, goes_on.way_u);
    let vv = dot(goes_on.way_v, goes_on.way_v);
    let uv = dot(goes_on.way_u, goes_on.way_v);
    let apart = uu * vv - uv * uv;
    if (apart <= LEAST_APART * uu * vv) {
        return MetByLight(point, normal);
    }
    let u = dot(way, goes_on.way_u);
    let v = dot(way, goes_on.way_v);
    let turn = ((vv * u - uv * v) * goes_on.turn_u + (uu * v - uv * u) * goes_on.turn_v) / apart;
    let bent = 0.5 * clamp(dot(turn, way), -skin.aside_mm, skin.aside_mm); // below the tangent plane
    let moved = way - bent * point.normal;
    var there = point;
    there.position += moved;
    there.lit_position += moved;
    there.normal = normalize(point.normal + turn);
    return MetByLight(there, normalize(normal + turn));
}
