// Light scattered on curved skin and across shadow edges, from tables of the profile [Penner2011]: `scattered` is the texture
// of the tables, and `shade.pre` contains their scales.

override PRE_INTEGRATED: bool = false;

const SPHERES: u32 = 33u; // rows, evenly by curvature
const EDGES: u32 = 9u; // rows, evenly by the half width of the shadow's penumbra up to `penumbra`
const PROBES: u32 = 64u; // points around a point; the fraction of them in the light gives the distance of a shadow edge
const GOLDEN: f32 = 2.3999632; // angle between consecutive probes, the outermost first
const FEWEST_PROBES: u32 = 24u; // probes after which the others are skipped if all agree
const MIN_COSINE: f32 = 0.3; // of the light on the plane of the probes
const MAX_LIFT_MM: f32 = 3.0; // largest lift of a point beyond the light's horizon [mm]
const CURVATURE_PROBES: u32 = 16u; // probes of the curvature towards the horizon
const CURVATURE_PROBES_MM: f32 = 2.0; // their radius around the line to the light

@group(0) @binding(35) var<storage, read> curvatures: array<f32>; // of the vertices [1/mm]

struct PreIntegrated {
    max_curvature: f32, // curvature of the table's last row [1/mm]
    penumbra: f32, // radius around a point in which shadow edges are searched [mm]
    relief: vec3f, // standard deviation of the Gaussian that smooths the relief [mm]
}

// t : corners of the triangle; w : barycentric weights
fn curvature_at(t: vec4u, w: vec3f) -> f32 {
    if (!PRE_INTEGRATED) {
        return 0.0;
    }
    return dot(w, vec3f(curvatures[t.x], curvatures[t.y], curvatures[t.z]));
}

// Value of the tables: rows of spheres, then of shadow edges.
fn table_at(x: f32, row: f32) -> vec3f {
    let size = vec2f(textureDimensions(scattered));
    return load_bilinear(scattered, (vec2f(x * (size.x - 1.0), row) + 0.5) / size).rgb;
}

// Scattered max(N.L, 0) for the cosines of red, green and blue.
fn scattered_cosine(cosines: vec3f, curvature: f32) -> vec3f {
    let row = f32(SPHERES - 1u) * min(curvature / shade.pre.max_curvature, 1.0);
    let x = 0.5 + 0.5 * cosines;
    return vec3f(table_at(x.r, row).r, table_at(x.g, row).g, table_at(x.b, row).b);
}

// Normals for red, green and blue light, without the relief that scattering smooths.
fn smoothed_normals(point: Point, footprint: f32) -> mat3x3f {
    let mm = max(sqrt(length(point.dpdu) * length(point.dpdv)), 1e-3); // per side of the uv square
    let wide = sqrt(footprint * footprint + 12.0 * shade.pre.relief * shade.pre.relief / (mm * mm));
    return mat3x3f(surface_at(point, wide.r).normal, surface_at(point, wide.g).normal, surface_at(point, wide.b).normal);
}

// A point that faces away from the light receives light from skin beyond its horizon: shadows are tested from there, on a
// plane that faces the light.
fn above_horizon(point: Point, l: vec3f) -> Point {
    var out = point;
    let cosine = dot(point.normal, l);
    let height = (inverseSqrt(max(1.0 - cosine * cosine, 1e-4)) - 1.0) / max(point.curvature, 1e-4);
    out.lit_position += point.normal * select(0.0, min(height, MAX_LIFT_MM), cosine < 0.0);
    out.normal = normalize(point.normal + l * max(0.0, MIN_COSINE - cosine));
    return out;
}

// Scattered visibility of a light for red, green and blue, by the distance to the shadow edge, which is assumed straight.
// Shadows of area lights, which are mostly wider, are unchanged.
fn scattered_visibility(light: Light, point: Point, l: vec3f) -> vec3f {
    let raised = above_horizon(point, l);
    let seen = clamp(visibility(light, raised, l), 0.0, 1.0);
    if (light.layer < 0 || (SHAPES && light.extent.x > 0.0)) {
        return vec3f(seen);
    }
    let texel = light.texel * select(distance(light.position, point.position), 1.0, is_parallel(light));
    let reach = texel * f32(light.half_width);
    let around = light_around(light, raised, l, reach, seen);
    let soft = reach * tent_on_surface(raised.normal, l, around.along);
    let radius = shade.pre.penumbra;
    if (soft >= radius) {
        return vec3f(seen);
    }
    let near = soft * select(1.0 - sqrt(2.0 - 2.0 * seen), sqrt(2.0 * seen) - 1.0, seen < 0.5); // inverse of the tent filter
    // probes find edges beyond the tent; they miss narrow shadows, so their weight increases gradually outside the tent
    let far = radius * (2.0 * around.fraction - 1.0);
    let beyond = select(min(far + soft, 0.0), max(far - soft, 0.0), seen > 0.5);
    let outside = abs(2.0 * seen - 1.0);
    let edge = near + outside * outside * outside * beyond;
    return table_at(0.5 + 0.5 * edge / radius, f32(SPHERES) + soft / radius * f32(EDGES - 1u));
}

// Width of the shadow filter on the surface, across an edge, relative to its width on the light's map.
fn tent_on_surface(normal: vec3f, l: vec3f, along: vec3f) -> f32 {
    let lean = dot(along, l);
    return sqrt(max(0.0, 1.0 - lean * lean)) / dot(normal, l);
}

struct Around {
    fraction: f32, // of the probes around a point that are lit
    along: vec3f, // unit vector on the surface along the shadow's edge
}

// Probes are the projection of an even distribution on a ball, so that an edge occludes a fraction that is linear in its
// distance. They are lifted off the surface like the point of the filter.
fn light_around(light: Light, point: Point, l: vec3f, lift: f32, unknown: f32) -> Around {
    let axes = shade.pre.penumbra * beside(point.normal);
    let cosine = clamp(dot(point.normal, l), 0.0, 1.0);
    let lifted = point.lit_position + lift * (sqrt(1.0 - cosine * cosine) * point.normal + 0.75 * l);
    let centre = light.to_map * vec4f(lifted, 1.0);
    let right = light.to_map * vec4f(axes[0], 0.0);
    let up = light.to_map * vec4f(axes[1], 0.0);
    // in hollows the surface may rise above the probes: they are lifted by twice the height that the curvature implies
    let rise = light.to_map * vec4f(l, 0.0) * (point.curvature * shade.pre.penumbra * shade.pre.penumbra);
    var lit = 0u;
    var known = 0u;
    var towards = vec2f(1e-6, 0.0);
    for (var i = 0u; i < PROBES; i++) {
        if (i == FEWEST_PROBES && (lit == 0u || lit == known)) {
            break;
        }
        let height = (f32(i) + 0.5) / f32(PROBES);
        let position = sqrt(1.0 - height * height) * vec2f(cos(GOLDEN * f32(i)), sin(GOLDEN * f32(i)));
        let state = probe_state(light, centre + position.x * right + position.y * up + dot(position, position) * rise);
        lit += u32(state == LIGHT);
        known += u32(state != AIR);
        towards += position * (f32(state == LIGHT) - f32(state == HIDDEN));
    }
    let along = normalize(axes * vec2f(-towards.y, towards.x));
    return Around(select(f32(lit) / f32(max(known, 1u)), unknown, known == 0u), along);
}

// State of a probe by the shadow map.
const HIDDEN: u32 = 0u;
const LIGHT: u32 = 1u;
const AIR: u32 = 2u; // lit, but in front of skin that is farther away than light scatters

fn probe_state(light: Light, clip: vec4f) -> u32 {
    if (clip.w <= 0.0) {
        return LIGHT;
    }
    let depth = clip.z / clip.w;
    let nearest = nearest_at(light, clip);
    if (nearest > depth) {
        return HIDDEN;
    }
    return select(LIGHT, AIR, depth_of(light, nearest) - depth_of(light, depth) > shade.pre.penumbra);
}

fn nearest_at(light: Light, clip: vec4f) -> f32 {
    let ndc = clip.xy / clip.w;
    let size = vec2f(textureDimensions(shadow_maps));
    let texel = vec2i(floor(vec2f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * size));
    return textureLoad(shadow_maps, clamp(texel, vec2i(0), vec2i(size) - 1), light.layer, 0).x;
}

// Curvature towards the horizon, which may be farther away than the curvature at the point implies: mean over spheres that
// touch the surface here and pass through a lit point near by.
fn curvature_towards(light: Light, point: Point, l: vec3f) -> f32 {
    let cosine = dot(point.normal, l);
    if (cosine >= MIN_COSINE || light.layer < 0 || (SHAPES && light.extent.x > 0.0)) {
        return point.curvature;
    }
    let axes = CURVATURE_PROBES_MM * beside(l);
    var sum = vec2f(0.0);
    for (var i = 0u; i < CURVATURE_PROBES; i++) {
        let lateral = axes * sample_point(i, true);
        let clip = light.to_map * vec4f(point.lit_position + lateral, 1.0);
        let offset = lateral + l * (depth_of(light, clip.z / clip.w) - depth_of(light, nearest_at(light, clip)));
        if (dot(offset, l) > -shade.pre.penumbra) { // else the surface is not near
            let ball = -2.0 * dot(offset, point.normal) / max(dot(offset, offset), 1e-4);
            sum += vec2f(clamp(ball, 0.0, point.curvature), 1.0);
        }
    }
    let found = select(sum.x / sum.y, point.curvature, sum.y == 0.0);
    return mix(found, point.curvature, smoothstep(0.0, MIN_COSINE, cosine));
}

// Irradiance that enters around a point and leaves there. The reflectance of the surface is evaluated at the mean cosine of
// the incident light.
fn pre_integrated(point: Point, surface: Surface, footprint: f32, open: f32) -> vec3f {
    let normals = smoothed_normals(point, footprint);
    var sum = vec3f(0.0);
    for (var i = 0u; i < skin.light_count; i++) {
        let light = lights.light[i];
        var seen = vec3f(-1.0); // visibility of the light, -1 before it is computed
        for (var part = 0u; part < parts_of(light); part++) {
            let arriving = incident(light, point.position, part);
            let curvature = curvature_towards(light, point, arriving.direction);
            let cosine = scattered_cosine(arriving.direction * normals, curvature);
            if (any(cosine > vec3f(0.0))) {
                if (seen.x < 0.0) {
                    seen = scattered_visibility(light, point, arriving.direction);
                }
                let mean = dot(cosine, vec3f(1.0 / 3.0));
                var entering = arriving.irradiance * cosine * seen * enters(mean, surface.roughness, surface.rho_s);
                if (HALF_SPACE) {
                    entering *= relative_reflectance(mean);
                }
                sum += entering;
            }
        }
    }
    if (ENVIRONMENT || INTERREFLECTION) {
        let smooth_surface = Surface(normals[1], surface.colour, surface.roughness, surface.rho_s);
        var entering = ambient_entering(point, smooth_surface, open);
        if (HALF_SPACE) {
            entering *= skin.uniform_reflectance;
        }
        sum += entering;
    }
    return sum;
}
