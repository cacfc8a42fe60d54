// Visibility of an area light from a point, by shadow rays that march through the light's shadow map.

const STEPS: u32 = 8u; // steps of a shadow ray
const NEAR_STEPS: u32 = 2u; // first steps, near the point's own surface
const MIN_THICKNESS: f32 = 4.0; // least thickness of occluders [mm]
const CROSSING_STEPS: f32 = 1.5; // number of steps that a ray may be behind a surface that it crosses
override RAY_STRIDE: u32 = 1u; // number of rays of which one is traced, above 1 in passes that do not show edges of shadows
const MIN_STRIDED_RAYS: u32 = 8u; // least number of rays per light in such passes
const MIN_PROBES: u32 = 8u; // number of rays after which the others are skipped if all agree

const MIN_EDGE_TEXELS: f32 = 1.5; // half width of the sharpest edge of a soft shadow

// A point in the frame of the light's map: right, up, forward.
struct Receiver {
    normal: vec3f,
    height: f32, // of the tangent plane over the light's position, along the normal [mm]
    position: vec2f, // on the map: divided by the depth, in parallel light in mm
    depth: f32, // [mm]
    min_half_width: f32, // of the edge of a shadow, in units of `position`
}

// Step of the rays from a point to the light.
struct RayStep {
    depth: f32, // [mm]
    spread: f32, // see `ray_spread`
    thickness: f32, // a ray farther behind a surface than this passes behind it [mm]
}

fn receiver(light: Light, point: Point) -> Receiver {
    let frame = mat3x3f(light.map_right, light.map_up, cross(light.map_up, light.map_right));
    let p = (point.lit_position - light.position) * frame;
    let n = point.normal * frame;
    if (is_parallel(light)) {
        return Receiver(n, dot(n, p), p.xy, p.z, max(light.softness, MIN_EDGE_TEXELS * light.texel));
    }
    return Receiver(n, dot(n, p), p.xy / p.z, p.z, max(light.softness / p.z, MIN_EDGE_TEXELS * light.texel));
}

// Fraction of the irradiance by an area light that arrives at a point: rays to points on the light are marched through its shadow
// map, and weighted by the cosine of incidence. Shadows are sharp close to their occluder.
fn soft_visibility(light: Light, point: Point) -> f32 {
    let at = receiver(light, point);
    if (at.depth <= light.map_near) {
        return 1.0;
    }
    let steps = occupied_steps(light, at);
    let rays = select(max(light.rays / RAY_STRIDE, MIN_STRIDED_RAYS), light.rays, RAY_STRIDE == 1u);
    let probes = max(rays / 4u, MIN_PROBES);
    var traced = 0u;
    var hidden = 0u;
    var all_light = 0.0;
    var hidden_light = 0.0;
    for (var i = 0u; i < rays; i += 4u) {
        let points = four_points(light, i);
        let heights = heights_above_plane(light, at, points);
        let rising = bits(heights > vec4f(0.0)) & ((1u << min(rays - i, 4u)) - 1u);
        if (rising == 0u) {
            continue; // below the tangent plane
        }
        if (steps == 0u) {
            return 1.0;
        }
        let blocked = occlusion_bits(light, at, points, steps);
        for (var left = rising; left != 0u; left &= left - 1u) {
            if (traced == probes && (hidden == 0u || hidden == probes)) {
                return select(0.0, 1.0, hidden == 0u); // all rays agree, as for most points
            }
            let ray = firstTrailingBit(left);
            let is_blocked = (blocked >> ray) & 1u;
            traced += 1u;
            hidden += is_blocked;
            all_light += heights[ray];
            hidden_light += heights[ray] * f32(is_blocked);
        }
    }
    return select(0.0, 1.0 - hidden_light / all_light, traced > 0u);
}

// Four points on a light or on its map, processed together so that their loads overlap.
struct FourPoints {
    x: vec4f,
    y: vec4f,
}

// Point of an even distribution over the square, or the disc, from -1 to 1.
fn sample_point(index: u32, round: bool) -> vec2f {
    return select(lights.sample_points[index].zw, lights.sample_points[index].xy, round);
}

fn four_points(light: Light, first: u32) -> FourPoints {
    let round = light.round != 0u;
    let a = sample_point(first, round);
    let b = sample_point(first + 1u, round);
    let c = sample_point(first + 2u, round);
    let d = sample_point(first + 3u, round);
    return FourPoints(vec4f(a.x, b.x, c.x, d.x), vec4f(a.y, b.y, c.y, d.y));
}

fn bits(which: vec4<bool>) -> u32 {
    return dot(select(vec4u(0u), vec4u(1u, 2u, 4u, 8u), which), vec4u(1u));
}

// Heights of points of the light above the tangent plane, which are proportional to the cosine of incidence.
fn heights_above_plane(light: Light, at: Receiver, points: FourPoints) -> vec4f {
    let x = points.x * light.extent.x;
    let y = points.y * light.extent.y;
    let bound = select(at.depth * (dot(at.normal.xy, at.position) + at.normal.z), at.normal.z, is_parallel(light));
    return at.normal.x * x + at.normal.y * y - bound;
}

// One bit for each of four points on the light, set if it is occluded.
fn occlusion_bits(light: Light, at: Receiver, points: FourPoints, steps: u32) -> u32 {
    var blocked = 0u;
    for (var left = steps; left != 0u && blocked != 15u; left &= left - 1u) {
        blocked |= bits(hides(light, at, points, ray_step(light, at.depth, firstTrailingBit(left))));
    }
    return blocked;
}

// One bit for each step, set if a surface may be nearer to the light than some ray there.
fn occupied_steps(light: Light, at: Receiver) -> u32 {
    let centre = texels_at(light, at.position);
    // most points have no occluder except their own surface
    let near = select(1u, 0u, is_clear(light, at, centre, 0u, 0u)) | select(2u, 0u, is_clear(light, at, centre, 1u, 1u));
    if (is_clear(light, at, centre, NEAR_STEPS, STEPS - 1u)) {
        return near;
    }
    var steps = near;
    for (var k = NEAR_STEPS; k < STEPS; k++) {
        steps |= select(1u << k, 0u, is_clear(light, at, centre, k, k));
    }
    return steps;
}

// Whether no surface is nearer to the light than the rays at the first step, within their spread at the last step.
fn is_clear(light: Light, at: Receiver, centre: vec2f, first: u32, last: u32) -> bool {
    let ray_spread = ray_step(light, at.depth, last).spread;
    let radius = (max(light.extent.x, light.extent.y) * ray_spread + at.min_half_width) / light.texel;
    let nearest = nearest_around(light, centre, radius);
    return (nearest == 0.0) | (depth_of(light, nearest) >= depth_on_ray(light, at.depth, f32(first) + 0.5));
}

// Lower bound of the depths within a radius around a point of the light's map; 1 for radii that are too large.
fn nearest_around(light: Light, position: vec2f, radius: f32) -> f32 {
    // half a square covers the radius
    let level = u32(radius > 2.0) + u32(radius > 4.0) + u32(radius > 8.0) + u32(radius > 16.0);
    let size = textureDimensions(shadow_bounds);
    let count = size.y >> level;
    let first = select(vec2u(0u), vec2u(size.y, size.y - 2u * count), level > 0u);
    let corner = clamp(round(position / f32(4u << level)), vec2f(1.0), vec2f(f32(count - 1u)));
    let found = textureGather(0, shadow_bounds, nearest_sampler, (vec2f(first) + corner) / vec2f(size), light.layer);
    return select(max(max(found.x, found.y), max(found.z, found.w)), 1.0, radius > 32.0);
}

// Whether a surface above the tangent plane occludes points of the light at a step.
fn hides(light: Light, at: Receiver, points: FourPoints, step: RayStep) -> vec4<bool> {
    let reach = step.spread * light.extent + at.min_half_width;
    let rays = FourPoints(at.position.x + reach.x * points.x, at.position.y + reach.y * points.y);
    let nearness = four_nearest(light, rays);
    let found = depths_of(light, nearness);
    let behind = step.depth - found;
    let spread = select(found, vec4f(1.0), is_parallel(light));
    let height = spread * (at.normal.x * rays.x + at.normal.y * rays.y) + at.normal.z * found - at.height;
    return (nearness > vec4f(0.0)) & (behind > vec4f(0.0)) & (behind < vec4f(step.thickness))
        & (height > 2.0 * light.texel * spread);
}

// Values of the map at four of its points, 0 outside.
fn four_nearest(light: Light, at: FourPoints) -> vec4f {
    let size = vec2i(textureDimensions(shadow_maps));
    let per_mm = 1.0 / light.texel;
    let x = vec4i(floor(0.5 * f32(size.x) + per_mm * at.x));
    let y = vec4i(floor(0.5 * f32(size.y) - per_mm * at.y));
    let u = clamp(x, vec4i(0), vec4i(size.x - 1));
    let v = clamp(y, vec4i(0), vec4i(size.y - 1));
    let values = vec4f(
        textureLoad(shadow_maps, vec2i(u.x, v.x), light.layer, 0).x,
        textureLoad(shadow_maps, vec2i(u.y, v.y), light.layer, 0).x,
        textureLoad(shadow_maps, vec2i(u.z, v.z), light.layer, 0).x,
        textureLoad(shadow_maps, vec2i(u.w, v.w), light.layer, 0).x,
    );
    return select(vec4f(0.0), values, (u == x) & (v == y));
}

fn depths_of(light: Light, nearness: vec4f) -> vec4f {
    return vec4f(
        depth_of(light, nearness.x), depth_of(light, nearness.y), depth_of(light, nearness.z), depth_of(light, nearness.w),
    );
}

fn ray_step(light: Light, from_depth: f32, step: u32) -> RayStep {
    let depth = depth_on_ray(light, from_depth, f32(step) + 0.5);
    let next = depth_on_ray(light, from_depth, f32(step) + 1.5);
    let thickness = max(MIN_THICKNESS, CROSSING_STEPS * (depth - next));
    return RayStep(depth, ray_spread(light, depth, from_depth), thickness);
}

// Distance on the map, at a depth, between the rays from a point to the edge and to the centre of the light; times the half sides
// of the light.
fn ray_spread(light: Light, depth: f32, from_depth: f32) -> f32 {
    if (is_parallel(light)) {
        return from_depth - depth;
    }
    return 1.0 / depth - 1.0 / from_depth;
}

// Depth after a number of steps from the point towards the light; the first steps are shorter, as near occluders need precision.
fn depth_on_ray(light: Light, from_depth: f32, step: f32) -> f32 {
    let part = step / f32(STEPS);
    let fraction = min(1.0, part * part * sqrt(part));
    if (is_parallel(light)) {
        return mix(from_depth, light.map_near, fraction);
    }
    return 1.0 / mix(1.0 / from_depth, 1.0 / light.map_near, fraction);
}

// A point of the light's map in texels.
fn texels_at(light: Light, position: vec2f) -> vec2f {
    return 0.5 * vec2f(textureDimensions(shadow_maps)) + vec2f(position.x, -position.y) / light.texel;
}
