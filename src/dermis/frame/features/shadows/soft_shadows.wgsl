// Share of an area light that reaches a point: shadow rays marched through the light's shadow map.

const STEPS: u32 = 8u; // of a shadow ray
const CLOSE: u32 = 2u; // steps that are near the point's own surface
const THICKNESS: f32 = 4.0; // least thickness of occluders [mm]
const STEEP: f32 = 1.5; // steps by which a ray may be behind a surface that it goes through
//#fill const LEAST_LINES: u32 = {least_lines}u; // rays, of those that a light has
const LEAST_PROBES: u32 = 8u; // rays after which the others are skipped if all agree
override RAYS_APART: u32 = 1u; // of the rays to a light one in so many is followed, where edges of shadows do not show

const LEAST_TEXELS: f32 = 1.5; // half width of the sharpest soft shadow's edge

// A point as the light sees it, in the map's frame: right, up, forward.
struct Receiver {
    normal: vec3f,
    height: f32, // of the tangent plane over the light's place, along the normal [mm]
    place: vec2f, // on the map: over the depth, in parallel light in mm
    depth: f32, // [mm]
    least: f32, // half width of the sharpest edge, as `place`
}

// One of the steps of the rays from a point to the light.
struct Station {
    depth: f32, // [mm]
    lean: f32, // times the light's half sides: distance on the map of the ray to its edge from that to its middle
    thickness: f32, // a ray farther behind a surface than this has passed behind it [mm]
}

fn receiver(light: Light, point: Point) -> Receiver {
    let frame = mat3x3f(light.map_right, light.map_up, cross(light.map_up, light.map_right));
    let p = (point.lit_position - light.position) * frame;
    let n = point.normal * frame;
    if (is_parallel(light)) {
        return Receiver(n, dot(n, p), p.xy, p.z, max(light.softness, LEAST_TEXELS * light.texel));
    }
    return Receiver(n, dot(n, p), p.xy / p.z, p.z, max(light.softness / p.z, LEAST_TEXELS * light.texel));
}

// Visible share of the part of an area light above the point's tangent plane: rays to places spread over the light are marched
// through its shadow map. Shadows are sharp close to their occluder.
fn soft_visibility(light: Light, point: Point) -> f32 {
    let at = receiver(light, point);
    if (at.depth <= light.map_near) {
        return 1.0;
    }
    let steps = steps_with_something(light, at);
    let lines = min(light.lines, max(light.lines / RAYS_APART, LEAST_LINES));
    let probes = max(lines / 4u, LEAST_PROBES);
    var followed = 0u;
    var hidden = 0u;
    for (var i = 0u; i < lines; i += 4u) {
        let places = four_places(light, i);
        let rising = bits(rise(light, at, places)) & ((1u << min(lines - i, 4u)) - 1u);
        if (rising == 0u) {
            continue; // below the tangent plane: they give no light here
        }
        if (steps == 0u) {
            return 1.0;
        }
        let met = hidden_of(light, at, places, steps);
        for (var left = rising; left != 0u; left &= left - 1u) {
            if (followed == probes && (hidden == 0u || hidden == probes)) {
                return select(0.0, 1.0, hidden == 0u); // wholly in light or in shadow, as most points are
            }
            followed += 1u;
            hidden += (met >> firstTrailingBit(left)) & 1u;
        }
    }
    return select(0.0, 1.0 - f32(hidden) / f32(followed), followed > 0u);
}

// Four places on a light or on its map, taken together so that their loads overlap.
struct Four {
    x: vec4f,
    y: vec4f,
}

// Places spread evenly over the square, or the disc, from -1 to 1.
fn place_on(index: u32, round: bool) -> vec2f {
    return select(lights.place[index].zw, lights.place[index].xy, round);
}

fn four_places(light: Light, first: u32) -> Four {
    let round = light.round != 0u;
    let a = place_on(first, round);
    let b = place_on(first + 1u, round);
    let c = place_on(first + 2u, round);
    let d = place_on(first + 3u, round);
    return Four(vec4f(a.x, b.x, c.x, d.x), vec4f(a.y, b.y, c.y, d.y));
}

fn bits(which: vec4<bool>) -> u32 {
    return dot(select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), which), vec4u(1u));
}

// Whether places of the light stand above the point's tangent plane.
fn rise(light: Light, at: Receiver, places: Four) -> vec4<bool> {
    let x = places.x * light.extent.x;
    let y = places.y * light.extent.y;
    if (is_parallel(light)) {
        return at.normal.x * x + at.normal.y * y > vec4f(at.normal.z);
    }
    let foot = at.depth * (dot(at.normal.xy, at.place) + at.normal.z);
    return at.normal.x * x + at.normal.y * y > vec4f(foot);
}

// A bit for each of four places on the light that is hidden.
fn hidden_of(light: Light, at: Receiver, places: Four, steps: u32) -> u32 {
    var met = 0u;
    for (var left = steps; left != 0u && met != 15u; left &= left - 1u) {
        met |= bits(hides(light, at, places, station_at(light, at.depth, firstTrailingBit(left))));
    }
    return met;
}

// A bit for each step at which anything is nearer to the light than rays to any place on it.
fn steps_with_something(light: Light, at: Receiver) -> u32 {
    let middle = texels_at(light, at.place);
    // Most points find nothing beyond their own surface.
    let close = select(1u, 0u, is_clear(light, at, middle, 0u, 0u)) | select(2u, 0u, is_clear(light, at, middle, 1u, 1u));
    if (is_clear(light, at, middle, CLOSE, STEPS - 1u)) {
        return close;
    }
    var steps = close;
    for (var k = CLOSE; k < STEPS; k++) {
        steps |= select(1u << k, 0u, is_clear(light, at, middle, k, k));
    }
    return steps;
}

// Whether nothing is nearer to the light than rays are at the first step, within their spread at the last.
fn is_clear(light: Light, at: Receiver, middle: vec2f, first: u32, last: u32) -> bool {
    let lean = station_at(light, at.depth, last).lean;
    let radius = (max(light.extent.x, light.extent.y) * lean + at.least) / light.texel;
    let nearest = nearest_around(light, middle, radius);
    return (nearest == 0.0) | (depth_of(light, nearest) >= depth_on_ray(light, at.depth, f32(first) + 0.5));
}

// A depth no farther than any within a radius around a place on the light's map; 1 where the radius is too large to say.
fn nearest_around(light: Light, place: vec2f, radius: f32) -> f32 {
    // half a square covers the radius
    let level = u32(radius > 2.0) + u32(radius > 4.0) + u32(radius > 8.0) + u32(radius > 16.0);
    let size = textureDimensions(shadow_bounds);
    let count = size.y >> level;
    let first = select(vec2u(0u), vec2u(size.y, size.y - 2u * count), level > 0u);
    let corner = clamp(round(place / f32(4u << level)), vec2f(1.0), vec2f(f32(count - 1u)));
    let found = textureGather(0, shadow_bounds, nearest_sampler, (vec2f(first) + corner) / vec2f(size), light.layer);
    return select(max(max(found.x, found.y), max(found.z, found.w)), 1.0, radius > 32.0);
}

// Whether something above the point's tangent plane hides places of the light at a station.
fn hides(light: Light, at: Receiver, places: Four, station: Station) -> vec4<bool> {
    let reach = station.lean * light.extent + at.least;
    let rays = Four(at.place.x + reach.x * places.x, at.place.y + reach.y * places.y);
    let nearness = four_nearest(light, rays);
    let found = depths_of(light, nearness);
    let behind = station.depth - found;
    let spread = select(found, vec4f(1.0), is_parallel(light));
    let height = spread * (at.normal.x * rays.x + at.normal.y * rays.y) + at.normal.z * found - at.height;
    return (nearness > vec4f(0.0)) & (behind > vec4f(0.0)) & (behind < vec4f(station.thickness))
        & (height > 2.0 * light.texel * spread);
}

// What the map holds at four places on it, 0 outside.
fn four_nearest(light: Light, at: Four) -> vec4f {
    let size = vec2i(textureDimensions(shadow_maps));
    let per_mm = 1.0 / light.texel;
    let x = vec4i(floor(0.5 * f32(size.x) + per_mm * at.x));
    let y = vec4i(floor(0.5 * f32(size.y) - per_mm * at.y));
    let u = clamp(x, vec4i(0), vec4i(size.x - 1));
    let v = clamp(y, vec4i(0), vec4i(size.y - 1));
    let held = vec4f(
        textureLoad(shadow_maps, vec2i(u.x, v.x), light.layer, 0).x,
        textureLoad(shadow_maps, vec2i(u.y, v.y), light.layer, 0).x,
        textureLoad(shadow_maps, vec2i(u.z, v.z), light.layer, 0).x,
        textureLoad(shadow_maps, vec2i(u.w, v.w), light.layer, 0).x,
    );
    return select(vec4f(0.0), held, (u == x) & (v == y));
}

fn depths_of(light: Light, nearness: vec4f) -> vec4f {
    return vec4f(
        depth_of(light, nearness.x), depth_of(light, nearness.y), depth_of(light, nearness.z), depth_of(light, nearness.w),
    );
}

fn station_at(light: Light, from_depth: f32, step: u32) -> Station {
    let depth = depth_on_ray(light, from_depth, f32(step) + 0.5);
    let next = depth_on_ray(light, from_depth, f32(step) + 1.5);
    let thickness = max(THICKNESS, STEEP * (depth - next));
    if (is_parallel(light)) {
        return Station(depth, from_depth - depth, thickness);
    }
    return Station(depth, 1.0 / depth - 1.0 / from_depth, thickness);
}

// Depth after a number of steps from the point to the nearest surface; steps are finer at first, where shadows are sharp.
fn depth_on_ray(light: Light, from_depth: f32, step: f32) -> f32 {
    let way = min(1.0, step * step / f32(STEPS * STEPS));
    if (is_parallel(light)) {
        return mix(from_depth, light.map_near, way);
    }
    return 1.0 / mix(1.0 / from_depth, 1.0 / light.map_near, way);
}

// A place on the light's map in its texels.
fn texels_at(light: Light, place: vec2f) -> vec2f {
    return 0.5 * vec2f(textureDimensions(shadow_maps)) + vec2f(place.x, -place.y) / light.texel;
}
