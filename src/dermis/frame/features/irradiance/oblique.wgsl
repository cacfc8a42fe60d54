// Light that enters at a slant goes on along its way before it scatters, and comes back from around a place beside where it
// entered: a point is lit as the surface is that far towards the light. Source: [WangJacques1995].
//#include "lights.wgsl"

override OBLIQUE: bool = false; // whether passes tell how the surface goes on beside a point

// How the surface bends around a point: a unit vector along it, and how the normal turns [1/mm] along that, along both that and
// the one across it, and across it.
struct Bend {
    along: vec3f,
    turns: vec3f,
}

var<private> bend_here: Bend;

// By how much light from a direction moves on before it comes back around a point, and the normal turns over there. Light that is
// finer than this way, as a laser's, mostly comes back from where it entered, and so stays.
struct Aside {
    moved: vec3f, // [mm]
    turn: vec3f,
}

fn aside_of(light: Light, normal: vec3f, l: vec3f) -> Aside {
    if (!OBLIQUE || light.sheet != 0u) {
        return Aside(vec3f(0.0), vec3f(0.0));
    }
    let way = skin.aside_mm * (l - dot(l, normal) * normal);
    let across = cross(normal, bend_here.along);
    let a = dot(way, bend_here.along);
    let b = dot(way, across);
    let turn = vec2f(bend_here.turns.x * a + bend_here.turns.y * b, bend_here.turns.y * a + bend_here.turns.z * b);
    let below = 0.5 * clamp(turn.x * a + turn.y * b, -skin.aside_mm, skin.aside_mm); // the tangent plane
    return Aside(way - below * normal, turn.x * bend_here.along + turn.y * across);
}

fn turned(normal: vec3f, aside: Aside) -> vec3f {
    if (!OBLIQUE) {
        return normal;
    }
    return normalize(normal + aside.turn);
}

fn moved_point(point: Point, aside: Aside) -> Point {
    var there = point;
    if (OBLIQUE) {
        there.position += aside.moved;
        there.lit_position += aside.moved;
        there.normal = turned(point.normal, aside);
    }
    return there;
}
