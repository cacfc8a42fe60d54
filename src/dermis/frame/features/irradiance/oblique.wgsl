// Oblique incidence: light travels along its direction before it scatters, so that its mean exit point is offset from the
// entry point. At a point, the entering light is therefore evaluated for the surface at this offset towards the light. Source:
// [WangJacques1995].
//#include "lights.wgsl"

override OBLIQUE: bool = false; // whether the pass provides the shape of the surface around a point

// Shape operator at a point: a unit vector along the surface, and the change of the normal [1/mm] along it, along both axes,
// and across it.
struct Bend {
    along: vec3f,
    turns: vec3f,
}

var<private> local_bend: Bend;

// Offset of the entry point of the light that leaves around a point, and the change of the normal there. Stripes, which are
// finer than the offset, mostly leave where they enter, and have none.
struct ObliqueOffset {
    position: vec3f, // [mm]
    normal: vec3f,
}

fn oblique_offset_of(light: Light, normal: vec3f, l: vec3f) -> ObliqueOffset {
    if (!OBLIQUE || light.sheet != 0u) {
        return ObliqueOffset(vec3f(0.0), vec3f(0.0));
    }
    let lateral = skin.oblique_offset_mm * (l - dot(l, normal) * normal);
    let across = cross(normal, local_bend.along);
    let a = dot(lateral, local_bend.along);
    let b = dot(lateral, across);
    let turn = vec2f(local_bend.turns.x * a + local_bend.turns.y * b, local_bend.turns.y * a + local_bend.turns.z * b);
    let below = 0.5 * clamp(turn.x * a + turn.y * b, -skin.oblique_offset_mm, skin.oblique_offset_mm); // depth below the tangent plane
    return ObliqueOffset(lateral - below * normal, turn.x * local_bend.along + turn.y * across);
}

fn normal_at_offset(normal: vec3f, offset: ObliqueOffset) -> vec3f {
    if (!OBLIQUE) {
        return normal;
    }
    return normalize(normal + offset.normal);
}

fn offset_point(point: Point, offset: ObliqueOffset) -> Point {
    var entry = point;
    if (OBLIQUE) {
        entry.position += offset.position;
        entry.lit_position += offset.position;
        entry.normal = normal_at_offset(point.normal, offset);
    }
    return entry;
}
