// How a place of the picture is shaded: light scattered below the skin, relit at its finest level, under the white lobe of the
// surface. The picture and what else a frame knows of its light call the same functions.
//#include "irradiance/lighting.wgsl"
//#include "mouth.wgsl"
//#include "occlusion/open_sky.wgsl"
//#include "lids.wgsl"
//#include "footprint.wgsl"
//#include "pre_integrated.wgsl"
//#include "diffusion/packed_blend_weights.wgsl"
//#include "irradiance/fine_light.wgsl"

override SPLIT: bool = false; // whether light below the skin is kept apart, to spread over the picture
override MIXED: bool = false; // whether a map mixes profiles: `scattered` then has their shares beside the light
override EYES: bool = false; // whether there are eyes of true shape, and teeth

const WET_ROUGHNESS: f32 = 0.1; // of plain materials: teeth, tongues, eyeballs of files

struct Shade {
    eye: vec3f,
    samples: u32,
    forward: vec3f,
    right: vec3f, // scaled so that forward + (x + shift) right + (y + shift) up spans the image for x, y in -1..1
    up: vec3f,
    shift: vec2f, // of the picture's middle from the axis
    relit: vec3f, // weight of the level that is not blurred
    relit_changes: array<vec4f, 2>, // by which that of other profiles differs
    total: vec3f, // weight of all levels
    shown: vec2f, // factors of the light from below and of the reflected light
    pre: PreIntegrated,
    fine: Fine,
    eyes: array<Eye, 2>,
    lids: array<vec4f, 112>, // edges of the lids around each eye, in its own space, half of them each; see human/lid_rings.csv
    material_colour: array<vec4f, 64>,
    jitter: array<vec4f, 64>, // sample places in the pixel, 0..1
}

@group(0) @binding(30) var<uniform> shade: Shade;
@group(0) @binding(32) var scattered: texture_2d<f32>; // light on the atlas, blurred and combined; or pre-integrated tables

// What a place of the picture shows, before it is lit.
struct Met {
    point: Point,
    surface: Surface,
    film: Film,
    lids: vec3f, // share of the light that the lids leave, which is in an eye's colour
    v: vec3f, // towards the viewer
    footprint: f32, // share of the maps' side
    open: f32, // share of the sky that it sees
    texel: TexelAxes, // where there is light finer than texels
}

struct Shaded {
    below: vec3f, // light below the skin
    leaving: vec3f, // share of it that leaves towards the eye
    still: vec3f, // light from below that does not spread: from plain materials, scattered only once
    reflected: vec3f, // off the surface
    depth: f32, // of skin [mm], else 0
}

fn is_opaque(point: Point) -> bool {
    return (point.flags & OPAQUE) != 0u;
}

// Weight of the level that is not blurred, at a place of the atlas.
fn relit_at(uv: vec2f) -> vec3f {
    if (!MIXED) {
        return shade.relit;
    }
    let most = vec2i(textureDimensions(scattered)) - 1;
    let place = uv * vec2f(most + 1) - 0.5;
    let a = clamp(vec2i(floor(place)), vec2i(0), most);
    let b = clamp(vec2i(floor(place)) + 1, vec2i(0), most);
    let w = bilinear_weights(place);
    let shares = w.x * shares_of(a) + w.y * shares_of(vec2i(b.x, a.y)) + w.z * shares_of(vec2i(a.x, b.y)) + w.w * shares_of(b);
    return shade.relit + shares.x * shade.relit_changes[0].rgb + shares.y * shade.relit_changes[1].rgb;
}

fn shares_of(at: vec2i) -> vec2f {
    return unpacked_shares(textureLoad(scattered, at, 0).a);
}

fn shaded_skin(met: Met, lit: Lit, out: f32) -> Shaded {
    let point = met.point;
    let surface = met.surface;
    let share = share_of(surface.colour, skin.mix);
    var below = lit.entered * share;
    if (PRE_INTEGRATED) {
        below = shade.total * pre_integrated(point, surface, met.footprint, met.open) * share;
    } else if ((point.flags & MAPPED) != 0u) {
        let relit = relit_at(point.place);
        below = relit * below + load_bilinear(scattered, point.place).rgb;
        if (STRIPE_LIGHT) {
            let side = vec2f(textureDimensions(scattered));
            below += share * finer_light(point, surface, met.texel, shade.fine, relit, side);
            below = max(below, vec3f(0.0));
        }
    } else {
        below *= shade.total;
    }
    let reflected = shade.shown.y * lit.reflected * mix(vec3f(1.0), surface.colour, skin.tint);
    var still = vec3f(0.0);
    var leaving = shade.shown.x * out * share_of(surface.colour, 1.0 - skin.mix);
    if (HALF_SPACE) {
        // Light above the mean has scattered once and is not blurred: at grazing angles it is many times the rest, and
        // blurred light from around must not be multiplied by it.
        let beyond = directional_share(lit, shade.total * share, below);
        still = below * leaving * max(beyond, vec3f(0.0));
        leaving *= 1.0 + min(beyond, vec3f(0.0));
    }
    return Shaded(below, leaving, still, reflected, dot(point.position - shade.eye, shade.forward));
}

fn shaded_plain(surface: Surface, lit: Lit, out: f32) -> Shaded {
    let below = lit.entered * surface.colour * out;
    return Shaded(vec3f(0.0), vec3f(0.0), shade.shown.x * below, shade.shown.y * lit.reflected, 0.0);
}

fn ray_through(place: vec2f, size: vec2f) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * place / size + vec2f(-1.0, 1.0);
    return shade.forward + (ndc.x + shade.shift.x) * shade.right + (ndc.y + shade.shift.y) * shade.up;
}

// share: part of the pixel that is shaded at once; maps are filtered over it.
fn met_at(triangle: u32, place: vec2f, share: f32, size: vec2f) -> Met {
    let t = triangle_at(triangle);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let weights = ray_to_weights(shade.eye, a.position, b.position, c.position);
    let w = meet(weights, ray_through(place, size));
    let inside = within(w); // a sample on an edge may lie a little outside
    var point = interpolate(a, b, c, inside, t.w);
    point.place = place_of_point(triangle, inside);
    point.curvature = curvature_at(t, inside);
    let open = open_sky(point, t, inside);
    let v = normalize(shade.eye - point.position);
    let spacing = sqrt(share);
    let wx = meet(weights, ray_through(place + vec2f(spacing, 0.0), size)) - w;
    let wy = meet(weights, ray_through(place + vec2f(0.0, spacing), size)) - w;
    let footprint = footprint_of(wx.x * a.uv + wx.y * b.uv + wx.z * c.uv, wy.x * a.uv + wy.y * b.uv + wy.z * c.uv);
    var surface: Surface;
    if (is_opaque(point)) {
        surface = Surface(point.normal, shade.material_colour[point.flags >> 8u].rgb, WET_ROUGHNESS, 1.0);
    } else {
        surface = surface_at(point, footprint);
    }
    var texel: TexelAxes;
    if (STRIPE_LIGHT) {
        texel = texel_axes(triangle, a, b, c, f32(textureDimensions(scattered).x));
        // The variance of as many samples as are shaded together.
        let samples = max(1.0, round(share * f32(shade.samples)));
        let deviation = sqrt((1.0 - 1.0 / samples) / 12.0);
        area_u = deviation * (wx.x * a.position + wx.y * b.position + wx.z * c.position);
        area_v = deviation * (wy.x * a.position + wy.y * b.position + wy.z * c.position);
    }
    let film = Film(surface.normal, vec3f(0.0));
    var met = Met(point, surface, film, vec3f(1.0), v, footprint, open, texel);
    if (EYES) {
        made_true(&met);
    }
    return met;
}

// Eyes of true shape, teeth and the tongue in place of plain material.
fn made_true(met: ptr<function, Met>) {
    let point = (*met).point;
    // A loop, because software adapters run both sides of a branch for all pixels, and a loop only while one needs it.
    var k = 0u;
    loop {
        if (!is_opaque(point) || k >= 2u) {
            break;
        }
        let material = shade.material_colour[point.flags >> 8u];
        if (material.w > 0.0) {
            (*met).surface = mouth_at(point, material);
            (*met).film = Film((*met).surface.normal, MOUTH_SCATTERED);
            break;
        }
        if (shade.eyes[k].material == (point.flags >> 8u)) {
            let own = (shade.eyes[k].to_own * vec4f(point.position, 1.0)).xyz;
            let lids = lids_around(k, own);
            let eye = eye_at(shade.eyes[k], own, lids, (*met).v);
            (*met).surface = eye.surface;
            (*met).film = eye.film;
            (*met).lids = lid_shade(lids);
            (*met).point.lit_position += SCATTERED_MM * eye.film.normal;
            break;
        }
        k++;
    }
}

fn lit_at(met: Met) -> Lit {
    // Called once: software adapters run both sides of a branch for all pixels.
    return light_through(met.point, met.surface, met.film, met.v, met.open);
}

fn shaded(met: Met, lit: Lit) -> Shaded {
    let out = leaves(dot(met.film.normal, met.v), met.surface.roughness, met.surface.rho_s) / PI;
    if (is_opaque(met.point)) {
        return shaded_plain(met.surface, lit, out);
    }
    return shaded_skin(met, lit, out);
}
