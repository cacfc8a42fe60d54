// The image: light that scattered below, relit at its finest level, under the white lobe of the surface.
//#include "lighting.wgsl"
//#include "pre_integrated.wgsl"

override SPLIT: bool = false; // whether light below the skin is kept apart, to spread over the picture

const EYE_ROUGHNESS: f32 = 0.1; // plain materials are wet: eyeballs, teeth
const FINEST_RATIO: f32 = 4.0; // longest over shortest side of a footprint that one map sample may stand for
const ONE_SURFACE: f32 = 4.0; // difference of depth within a pixel over its width that is still one surface
const CROSSED: f32 = 2.0; // step in depth that light below the skin crosses [mm]: no other surface either

struct Shade {
    eye: vec3f,
    samples: u32,
    forward: vec3f,
    right: vec3f, // scaled so that forward + x right + y up spans the image for x, y in -1..1
    up: vec3f,
    relit: vec3f, // weight of the level that is not blurred
    total: vec3f, // weight of all levels
    shown: vec2f, // factors of the light from below and of that off the surface
    pre: PreIntegrated,
    background: vec3f,
    material_colour: array<vec4f, 64>,
    jitter: array<vec4f, 64>, // sample places in the pixel, 0..1
}

@group(1) @binding(0) var<uniform> shade: Shade;
@group(1) @binding(1) var seen: texture_2d_array<u32>;
@group(1) @binding(2) var scattered: texture_2d<f32>; // per texel of the atlas, blurred and combined; or pre-integrated
@group(1) @binding(3) var image: texture_storage_2d<rgba32float, write>;
@group(1) @binding(4) var apart: texture_storage_2d_array<rgba32float, write>; // light below, depth; its share that leaves

struct Shaded {
    below: vec3f, // light below the skin
    leaving: vec3f, // share of it that leaves towards the eye
    over: vec3f, // light that does not spread: off the surface, from plain materials
    depth: f32, // of skin [mm], else 0
}

// t: corners of the triangle, w: barycentric weights
fn open_sky(point: Point, t: vec4u, w: vec3f) -> f32 {
    if (!ENVIRONMENT) {
        return 1.0;
    }
    if ((t.w & MAPPED) != 0u) {
        return open_at(point.place);
    }
    return dot(w, vec3f(open_at_vertex(t.x), open_at_vertex(t.y), open_at_vertex(t.z)));
}

fn shaded_skin(point: Point, v: vec3f, footprint: f32, open: f32) -> Shaded {
    let surface = surface_at(point, footprint);
    let lit = light_up(point, surface, v, open);
    var below = lit.entered * share_of(surface.colour, skin.mix);
    if (PRE_INTEGRATED) {
        below = shade.total * pre_integrated(point, surface, footprint, open) * share_of(surface.colour, skin.mix);
    } else if ((point.flags & MAPPED) != 0u) {
        below = shade.relit * below + load_bilinear(scattered, point.place).rgb;
    } else {
        below *= shade.total;
    }
    let out = leaves(dot(surface.normal, v), surface.roughness, surface.rho_s) / PI;
    let tint = mix(vec3f(1.0), surface.colour, skin.tint);
    let depth = dot(point.position - shade.eye, shade.forward);
    let leaving = shade.shown.x * out * share_of(surface.colour, 1.0 - skin.mix);
    return Shaded(below, leaving, shade.shown.y * lit.reflected * tint, depth);
}

fn shaded_plain(point: Point, v: vec3f, open: f32) -> Shaded {
    let colour = shade.material_colour[point.flags >> 8u].rgb;
    let lit = light_up(point, Surface(point.normal, colour, EYE_ROUGHNESS, 1.0), v, open);
    let below = lit.entered * colour * leaves(dot(point.normal, v), EYE_ROUGHNESS, 1.0) / PI;
    return Shaded(vec3f(0.0), vec3f(0.0), shade.shown.x * below + shade.shown.y * lit.reflected, 0.0);
}

// Barycentric weights of where a ray from the eye meets a triangle's plane are linear in the ray, up to scale.
fn ray_to_weights(a: vec3f, b: vec3f, c: vec3f) -> mat3x3f {
    let ea = a - shade.eye;
    let eb = b - shade.eye;
    let ec = c - shade.eye;
    return transpose(mat3x3f(cross(eb, ec), cross(ec, ea), cross(ea, eb)));
}

fn meet(weights: mat3x3f, ray: vec3f) -> vec3f {
    let w = weights * ray;
    return w / (w.x + w.y + w.z);
}

fn ray_through(place: vec2f, size: vec2f) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * place / size + vec2f(-1.0, 1.0);
    return shade.forward + ndc.x * shade.right + ndc.y * shade.up;
}

// share: part of the pixel that this shading stands for; maps are filtered over it.
fn shaded(triangle: u32, place: vec2f, share: f32, size: vec2f) -> Shaded {
    let t = triangle_at(triangle);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let weights = ray_to_weights(a.position, b.position, c.position);
    let w = meet(weights, ray_through(place, size));
    // A sample on an edge may lie a little outside: stay on the triangle.
    let clamped = max(w, vec3f(0.0));
    let inside = clamped / (clamped.x + clamped.y + clamped.z);
    var point = interpolate(a, b, c, inside, t.w);
    point.place = place_of_point(triangle, inside);
    let open = open_sky(point, t, inside);
    let v = normalize(shade.eye - point.position);
    if ((t.w & OPAQUE) != 0u) {
        return shaded_plain(point, v, open);
    }
    let spacing = sqrt(share);
    let wx = meet(weights, ray_through(place + vec2f(spacing, 0.0), size)) - w;
    let wy = meet(weights, ray_through(place + vec2f(0.0, spacing), size)) - w;
    let x = length(wx.x * a.uv + wx.y * b.uv + wx.z * c.uv);
    let y = length(wy.x * a.uv + wy.y * b.uv + wy.z * c.uv);
    return shaded_skin(point, v, max(min(x, y), max(x, y) / FINEST_RATIO), open);
}

// The skin of one pixel, each member times the share of its samples.
struct PixelSkin {
    below: vec3f,
    leaving: vec3f,
    depth: f32,
    share: f32,
}

// Adds a part of a pixel to its skin, which is the one surface that most samples see.
fn keep(held: PixelSkin, part: Shaded, share: f32, pixel: f32) -> PixelSkin {
    let one = PixelSkin(share * part.below, share * part.leaving, share * part.depth, share);
    let apart = abs(part.depth - held.depth / max(held.share, 1e-6));
    if (held.share > 0.0 && apart <= max(ONE_SURFACE * pixel * part.depth, CROSSED)) {
        return PixelSkin(held.below + one.below, held.leaving + one.leaving, held.depth + one.depth, held.share + share);
    }
    if (share > held.share) {
        return one;
    }
    return held;
}

// One of 64 bits.
fn bit_of(index: u32) -> vec2u {
    return select(vec2u(0u, 1u << (index % 32u)), vec2u(1u << (index % 32u), 0u), index < 32u);
}

// As many bits from the first on.
fn samples_of(count: u32) -> vec2u {
    return vec2u(extractBits(~0u, 0u, min(count, 32u)), extractBits(~0u, 0u, max(count, 32u) - 32u));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(image);
    if (any(id.xy >= size)) {
        return;
    }
    let pixel = vec2f(id.xy);
    var sum = vec4f(0.0);
    var skin_below: PixelSkin;
    var left = samples_of(shade.samples);
    // Samples that see one triangle are shaded together: its maps are filtered over their part of the pixel.
    while (any(left != vec2u(0u))) {
        let first = select(32u + firstTrailingBit(left.y), firstTrailingBit(left.x), left.x != 0u);
        let triangle = textureLoad(seen, id.xy, first, 0).x;
        var place = vec2f(0.0);
        var n = 0u;
        for (var s = first; s < shade.samples; s++) {
            if (textureLoad(seen, id.xy, s, 0).x == triangle) {
                place += shade.jitter[s].xy;
                n++;
                left &= ~bit_of(s);
            }
        }
        let share = f32(n) / f32(shade.samples);
        if (triangle > 0u) {
            let part = shaded(triangle - 1u, pixel + place / f32(n), share, vec2f(size));
            sum += share * vec4f(part.below * part.leaving + part.over, 1.0);
            if (SPLIT && part.depth > 0.0) {
                skin_below = keep(skin_below, part, share, 2.0 * length(shade.up) / f32(size.y));
            }
        }
    }
    if (SPLIT) {
        // What is taken out here comes back spread; light of a pixel's lesser surfaces stays where it is.
        let held = max(skin_below.share, 1e-6);
        sum -= vec4f(skin_below.below * skin_below.leaving / held, 0.0);
        textureStore(apart, id.xy, 0, vec4f(skin_below.below, skin_below.depth) / held);
        textureStore(apart, id.xy, 1, vec4f(skin_below.leaving, 0.0));
    }
    let behind = seen_behind(ray_through(pixel + 0.5, vec2f(size)), shade.background);
    textureStore(image, id.xy, vec4f(sum.rgb + (1.0 - sum.a) * behind, sum.a));
}
