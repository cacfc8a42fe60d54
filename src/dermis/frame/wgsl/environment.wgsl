// Light of the environment: irradiance and prefiltered reflections of a panorama, reduced by occlusion.
//#include "environment_record.wgsl"

override ENVIRONMENT: bool = false; // whether the scene has an environment

//#fill const LAYERS: f32 = {reflections}; // layers of reflections, evenly spaced in the logarithm of the roughness
//#fill const SMOOTHEST: f32 = {smoothest_reflection}; // roughness of the first and of the last layer
//#fill const ROUGHEST: f32 = {roughest_reflection};
//#fill const MIRRORS: vec2u = vec2u({mirror_views}u, {mirror_rough}u); // columns and rows of the table of lobes
//#fill const LOBES: u32 = {mirror_lobes}u; // number of isotropic lobes that approximate the lobe of the surface
//#fill const SMOOTHEST_MIRROR: f32 = {mirror_smoothest}; // roughness of the first and of the last row of that table
//#fill const ROUGHEST_MIRROR: f32 = {mirror_roughest};

@group(0) @binding(21) var panorama: texture_2d_array<f32>; // irradiance, then mean radiance by roughness
@group(0) @binding(22) var occlusion_map: texture_2d<f32>; // unoccluded fraction of the sky: the atlas, then the vertices

// A layer of the panorama in a direction, bilinear; its border repeats the texels across the seam and the poles.
fn panorama_at(direction: vec3f, layer: u32) -> vec3f {
    let d = vec3f(
        environment.turn.x * direction.x - environment.turn.y * direction.z,
        direction.y,
        environment.turn.y * direction.x + environment.turn.x * direction.z,
    );
    let azimuth = select(0.0, atan2(d.x, -d.z), any(d.xz != vec2f(0.0))); // undefined at the poles
    let uv = vec2f(0.5 + azimuth / (2.0 * PI), atan2(length(d.xz), d.y) / PI);
    // filtered in the shader, as the filters of some GPUs are too coarse for wide textures
    let position = uv * (vec2f(textureDimensions(panorama)) - 2.0) + 0.5;
    let a = vec2i(floor(position));
    let w = bilinear_weights(position);
    let upper = w.x * textureLoad(panorama, a, layer, 0) + w.y * textureLoad(panorama, a + vec2i(1, 0), layer, 0);
    let lower = w.z * textureLoad(panorama, a + vec2i(0, 1), layer, 0) + w.w * textureLoad(panorama, a + vec2i(1, 1), layer, 0);
    return environment.exposure * (upper + lower).rgb;
}

// Mean radiance under a lobe of roughness m about a direction.
fn reflection(direction: vec3f, m: f32) -> vec3f {
    let layer = (LAYERS - 1.0) * clamp(log(m / SMOOTHEST) / log(ROUGHEST / SMOOTHEST), 0.0, 1.0);
    let low = min(u32(layer), u32(LAYERS) - 2u);
    return mix(panorama_at(direction, 1u + low), panorama_at(direction, 2u + low), layer - f32(low));
}

// Irradiance with occlusion and the interreflection of the occluding skin: a fit to path-traced corners [Jimenez2016].
fn ambient(normal: vec3f, open: f32, albedo: vec3f) -> vec3f {
    return panorama_at(normal, 0u) * open_with_bounces(open, albedo);
}

fn open_with_bounces(open: f32, albedo: vec3f) -> vec3f {
    let a = 2.0404 * albedo - 0.3324;
    let b = -4.7951 * albedo + 0.6417;
    let c = 2.7552 * albedo + 0.6903;
    return max(vec3f(open), ((open * a + b) * open + c) * open);
}

// Coordinates in the table of lobes: square root of the cosine, and logarithm of the roughness.
fn mirror_coordinates(cosine: f32, m: f32) -> vec2f {
    let coordinates = vec2f(sqrt(cosine), log(m / SMOOTHEST_MIRROR) / log(ROUGHEST_MIRROR / SMOOTHEST_MIRROR));
    return clamp(coordinates, vec2f(0.0), vec2f(1.0)) * vec2f(MIRRORS - 1u);
}

// Direction of an isotropic lobe in the stereographic projection around the mirror direction (away from the eye, and across
// the plane of incidence), its roughness and its weight.
fn mirror_at(coordinates: vec2f, lobe: u32) -> vec4f {
    let at = min(vec2u(coordinates), MIRRORS - 2u);
    let f = coordinates - vec2f(at);
    let row = LOBES * (at.y * MIRRORS.x + at.x) + lobe;
    let below = row + LOBES * MIRRORS.x;
    let low = mix(environment.mirrors[row], environment.mirrors[row + LOBES], f.x);
    let high = mix(environment.mirrors[below], environment.mirrors[below + LOBES], f.x);
    return mix(low, high, f.y);
}

// Reflected radiance for a specular albedo of 1, reduced by specular occlusion [LagardeRousiers2014] and below the horizon
// of the surface without relief.
fn mirrored(point: Point, normal: vec3f, v: vec3f, m: f32, open: f32) -> vec3f {
    let cosine = clamp(dot(normal, v), 0.0, 1.0);
    let coordinates = mirror_coordinates(cosine, m);
    let across = cosine * normal - v; // away from the eye
    let sine = length(across);
    let along = across / max(sine, 1e-6);
    let ahead = sine * along + cosine * normal; // the mirror direction
    let aside = cross(normal, along);
    let away = cosine * along - sine * normal;
    var sum = vec3f(0.0);
    var k = 0u;
    loop {
        let mirror = mirror_at(coordinates, k);
        if (mirror.w > 0.0) {
            let square = dot(mirror.xy, mirror.xy);
            let direction = (2.0 * (mirror.x * away + mirror.y * aside) + (1.0 - square) * ahead) / (1.0 + square);
            let risen = clamp(1.0 + dot(direction, point.normal) / m, 0.0, 1.0);
            sum += mirror.w * risen * reflection(direction, mirror.z);
        }
        k++;
        if (k >= LOBES) {
            break;
        }
    }
    let seen = clamp(pow(cosine + open, exp2(-16.0 * m - 1.0)) - 1.0 + open, 0.0, 1.0);
    return seen * sum;
}

// Unoccluded fraction of the sky at a position of the atlas.
fn open_at(uv: vec2f) -> f32 {
    if (environment.occluded == 0u) {
        return 1.0;
    }
    let size = vec2f(textureDimensions(occlusion_map));
    return load_bilinear(occlusion_map, uv * vec2f(1.0, size.x / size.y)).x;
}

// Unoccluded fraction of the sky at a vertex, for surfaces that are not in the atlas.
fn open_at_vertex(index: u32) -> f32 {
    if (environment.occluded == 0u) {
        return 1.0;
    }
    let side = textureDimensions(occlusion_map).x;
    return textureLoad(occlusion_map, vec2u(index % side, side + 1u + index / side), 0).x;
}
