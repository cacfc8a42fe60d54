// Which share of a light reaches a point, from the light's map of depths.

const STEPS: u32 = 8u; // of a line of sight to a light of some size
const THICKNESS: f32 = 4.0; // that what hides has at least [mm]
const STEEP: f32 = 1.5; // steps by which a line may be behind a surface just before it goes through
const LEAST_PROBES: u32 = 8u; // lines of sight that may stand for all
const LEAST_TEXELS: f32 = 1.5; // half width of the sharpest soft shadow's edge

// The point moves off the surface by the filter's width, so that the surface does not shade itself.
fn visibility(light: Light, point: Point, l: vec3f) -> f32 {
    if (light.layer < 0) {
        return 1.0;
    }
    if (SHAPES && light.extent.x > 0.0) {
        return soft_visibility(light, point);
    }
    var texel = light.texel;
    if (!is_parallel(light)) {
        texel *= distance(light.position, point.position);
    }
    let cosine = clamp(dot(point.normal, l), 0.0, 1.0);
    let reach = texel * f32(light.half_width);
    let lifted = point.lit_position + point.normal * (reach * sqrt(1.0 - cosine * cosine)) + l * (0.75 * reach);
    let clip = light.to_map * vec4f(lifted, 1.0);
    if (clip.w <= 0.0) {
        return 1.0;
    }
    let ndc = clip.xyz / clip.w;
    return filtered_depth(light, vec2f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y), ndc.z);
}

// Percentage-closer filtering [Reeves1987] under a tent.
fn filtered_depth(light: Light, uv: vec2f, depth: f32) -> f32 {
    let size = vec2f(textureDimensions(shadow_maps));
    let place = uv * size - 0.5;
    let base = floor(place);
    let f = place - base;
    let h = i32(light.half_width);
    let width = f32(h);
    var lit = 0.0;
    for (var j = 1 - h; j < h + 1; j += 2) {
        let wy = max(vec2f(0.0), width - abs(vec2f(f32(j), f32(j + 1)) - f.y));
        for (var i = 1 - h; i < h + 1; i += 2) {
            let wx = max(vec2f(0.0), width - abs(vec2f(f32(i), f32(i + 1)) - f.x));
            // gather returns the quad's texels in the order (0,1) (1,1) (1,0) (0,0)
            let quad = (base + vec2f(f32(i), f32(j)) + 1.0) / size;
            let nearest = textureGather(0, shadow_maps, shadow_sampler, quad, light.layer);
            let free = select(vec4f(0.0), vec4f(1.0), nearest <= vec4f(depth));
            lit += dot(free, vec4f(wx.x * wy.y, wx.y * wy.y, wx.y * wy.x, wx.x * wy.x));
        }
    }
    return lit / (width * width * width * width);
}

// A point as the light sees it, in the map's frame: right, up, forward.
struct Receiver {
    normal: vec3f,
    height: f32, // of the tangent plane over the light's place, along the normal [mm]
    place: vec2f, // on the map: over the depth, in parallel light in mm
    depth: f32, // [mm]
}

// Share of what rises of a light of some size that is in sight: lines to places spread over it are followed through the
// light's map of depths. Close to what hides it a shadow is sharp.
fn soft_visibility(light: Light, point: Point) -> f32 {
    let frame = mat3x3f(light.map_right, light.map_up, cross(light.map_up, light.map_right));
    let p = (point.lit_position - light.position) * frame;
    let n = point.normal * frame;
    let parallel = is_parallel(light);
    if (p.z <= light.map_near) {
        return 1.0;
    }
    let at = Receiver(n, dot(n, p), select(p.xy / p.z, p.xy, parallel), p.z);
    let least = max(select(light.softness / p.z, light.softness, parallel), LEAST_TEXELS * light.texel);
    let probes = max(light.lines / 4u, LEAST_PROBES);
    var followed = 0u;
    var hidden = 0u;
    for (var i = 0u; i < light.lines; i++) {
        let place = place_on(i, light.kind != RECTANGLE);
        if (!rises(light, at, place)) {
            continue; // it gives no light here, as its cosine says
        }
        if (followed == probes && (hidden == 0u || hidden == probes)) {
            break; // wholly in light or in shadow, as most points are
        }
        followed += 1u;
        hidden += hides(light, at, least, place);
    }
    return select(0.0, 1.0 - f32(hidden) / f32(followed), followed > 0u);
}

// Whether a place of the light stands above the point's tangent plane.
fn rises(light: Light, at: Receiver, place: vec2f) -> bool {
    let lateral = place * light.extent;
    let towards = select(vec3f(lateral - at.place * at.depth, -at.depth), vec3f(lateral, -1.0), is_parallel(light));
    return dot(at.normal, towards) > 0.0;
}

// 1 when something above the point's tangent plane is in the way to a place of the light.
fn hides(light: Light, at: Receiver, least: f32, place: vec2f) -> u32 {
    let size = vec2f(textureDimensions(shadow_maps));
    let parallel = is_parallel(light);
    let lateral = place * light.extent;
    for (var k = 0u; k < STEPS; k++) {
        let depth = depth_on_line(light, at.depth, f32(k) + 0.5);
        let lean = select(1.0 / depth - 1.0 / at.depth, at.depth - depth, parallel);
        let line = at.place + lateral * lean + least * place;
        let texel = vec2i(floor(0.5 * size + vec2f(line.x, -line.y) / light.texel));
        if (any(texel < vec2i(0)) || any(texel >= vec2i(size))) {
            continue;
        }
        let nearness = textureLoad(shadow_maps, texel, light.layer, 0).x;
        let found = depth_of(light, nearness);
        let blocker = select(vec3f(found * line, found), vec3f(line, found), parallel);
        let slack = 2.0 * light.texel * select(found, 1.0, parallel);
        // A line farther behind went past the edge of what is in front.
        let thickness = max(THICKNESS, STEEP * (depth - depth_on_line(light, at.depth, f32(k) + 1.5)));
        let behind = depth - found;
        if (nearness > 0.0 && behind > 0.0 && behind < thickness && dot(at.normal, blocker) - at.height > slack) {
            return 1u;
        }
    }
    return 0u;
}

// Depth after a number of steps from the point to the nearest surface, finer at first: shadows are sharp there.
fn depth_on_line(light: Light, from_depth: f32, step: f32) -> f32 {
    let way = min(1.0, step * step / f32(STEPS * STEPS));
    if (is_parallel(light)) {
        return mix(from_depth, light.map_near, way);
    }
    return 1.0 / mix(1.0 / from_depth, 1.0 / light.map_near, way);
}

// Places spread evenly over the square, or the disc, from -1 to 1 [Roberts2018].
fn place_on(index: u32, round: bool) -> vec2f {
    let even = fract(vec2f(0.5) + f32(index) * vec2f(0.7548776662, 0.5698402910));
    if (round) {
        let phi = 2.0 * PI * even.y;
        return sqrt(even.x) * vec2f(cos(phi), sin(phi));
    }
    return 2.0 * even - 1.0;
}

// Depth along the map's axis [mm] of what the map holds.
fn depth_of(light: Light, nearness: f32) -> f32 {
    if (is_parallel(light)) {
        return mix(light.map_far, light.map_near, nearness);
    }
    return light.map_near * light.map_far / (nearness * (light.map_far - light.map_near) + light.map_near);
}
