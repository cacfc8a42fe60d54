// Shading of a point of the surface: light scattered below the skin, with its finest Gaussian evaluated per pixel, and the
// specular reflection. The picture and the outputs of light call the same functions.
//#include "irradiance/lighting.wgsl"
//#include "parts.wgsl"
//#include "mouth.wgsl"
//#include "occlusion/open_sky.wgsl"
//#include "lids.wgsl"
//#include "lips.wgsl"
//#include "footprint.wgsl"
//#include "pre_integrated.wgsl"
//#include "diffusion/packed_blend_weights.wgsl"
//#include "irradiance/subtexel_light.wgsl"

override SPLIT: bool = false; // whether light below the skin is stored in layers of its own, to be diffused over the picture
override VELLUS: bool = false; // whether the skin has vellus hair
override MIXED: bool = false; // whether a map mixes profiles: the alpha of `scattered` then holds their blend weights

struct Shade {
    eye: vec3f,
    samples: u32,
    forward: vec3f,
    right: vec3f, // scaled so that forward + (x + shift) right + (y + shift) up spans the image for x, y in -1..1
    up: vec3f,
    shift: vec2f, // offset of the middle of the picture from the axis
    unblurred_weight: vec3f, // weight of the unblurred level
    unblurred_differences: array<vec4f, 2>, // difference for each of the other profiles
    total: vec3f, // sum of the weights of all levels
    light_factors: vec2f, // factors of light from below the skin and of reflected light
    pre: PreIntegrated,
    fine: Fine,
    eyes: array<Eye, 2>,
    skin_albedo: vec3f, // mean of the head
    lids: array<vec4f, 112>, // edges of the lids in the space of each eye, half of the points for each; see human/lid_rings.csv
    lips: array<vec4f, 38>, // edge of the lips in head space, and the area of the opening between them [mm^2]; zeros if unknown
    teeth_below_lip: vec3f, // from the upper lip to the biting edge of the upper teeth, in the middle [mm]
    tongue: array<vec4f, 2>, // from (u, v, 1) to distances from the midline and behind the tip of the tongue [mm]
    material_colour: array<vec4f, 64>,
    part_materials: array<PartMaterial, 64>,
    jitter: array<vec4f, 64>, // positions of samples in the pixel, 0..1
}

@group(0) @binding(30) var<uniform> shade: Shade;
@group(0) @binding(32) var scattered: texture_2d<f32>; // blurred and combined light over the atlas, or pre-integrated tables

// A point to be shaded.
struct ShadingPoint {
    point: Point,
    surface: Surface,
    film: Film,
    v: vec3f, // towards the viewer
    footprint: f32, // side of the filter relative to the side of the maps
    open: f32, // visible fraction of the sky
    texel: TexelAxes, // if there is light that is finer than texels
    metalness: f32, // of parts that are not skin
    emission: vec3f, // radiance that such parts emit
    sheen: vec3f, // of cloth
}

struct Shaded {
    below: vec3f, // light below the skin
    leaving: vec3f, // fraction of that light that leaves towards the eye
    local: vec3f, // light from below that is not diffused: of plain materials, and scattered once
    reflected: vec3f, // specular reflection
    depth: f32, // of skin [mm], else 0
}

fn is_opaque(point: Point) -> bool {
    return (point.flags & OPAQUE) != 0u;
}

// Weight of the unblurred level at a position of the atlas.
fn unblurred_weight_at(uv: vec2f) -> vec3f {
    if (!MIXED) {
        return shade.unblurred_weight;
    }
    let last = vec2i(textureDimensions(scattered)) - 1;
    let position = uv * vec2f(last + 1) - 0.5;
    let a = clamp(vec2i(floor(position)), vec2i(0), last);
    let b = clamp(vec2i(floor(position)) + 1, vec2i(0), last);
    let w = bilinear_weights(position);
    let weights = w.x * blend_weights_at(a) + w.y * blend_weights_at(vec2i(b.x, a.y)) + w.z * blend_weights_at(vec2i(a.x, b.y)) + w.w * blend_weights_at(b);
    return shade.unblurred_weight + weights.x * shade.unblurred_differences[0].rgb + weights.y * shade.unblurred_differences[1].rgb;
}

fn blend_weights_at(at: vec2i) -> vec2f {
    return unpacked_weights(textureLoad(scattered, at, 0).a);
}

fn shaded_skin(shading_point: ShadingPoint, lit: Lit, exit_factor: f32) -> Shaded {
    let point = shading_point.point;
    let surface = shading_point.surface;
    let entering = colour_power(surface.colour, skin.mix);
    var below = lit.entered * entering;
    if (PRE_INTEGRATED) {
        below = shade.total * pre_integrated(point, surface, shading_point.footprint, shading_point.open) * entering;
    } else if ((point.flags & MAPPED) != 0u) {
        let unblurred_weight = unblurred_weight_at(point.atlas_uv);
        below = unblurred_weight * below + load_bilinear(scattered, point.atlas_uv).rgb;
        if (STRIPE_LIGHT) {
            let side = vec2f(textureDimensions(scattered));
            below += entering * light_finer_than_texels(point, surface, shading_point.texel, shade.fine, unblurred_weight, side);
            below = max(below, vec3f(0.0));
        }
    } else {
        below *= shade.total;
    }
    let reflected = shade.light_factors.y * lit.reflected * mix(vec3f(1.0), surface.colour, skin.tint);
    var local = vec3f(0.0);
    var leaving = shade.light_factors.x * exit_factor * colour_power(surface.colour, 1.0 - skin.mix);
    if (HALF_SPACE) {
        // Light above the mean has scattered once and is not blurred: at grazing angles it is many times the blurred light, which
        // must not be multiplied by it.
        let excess = directional_fraction(lit, shade.total * entering, below);
        local = below * leaving * max(excess, vec3f(0.0));
        leaving *= 1.0 + min(excess, vec3f(0.0));
    }
    //#if VELLUS
    leaving *= through_vellus(point.normal, shading_point.v);
    local += shade.light_factors.x * lit.vellus;
    //#end
    return Shaded(below, leaving, local, reflected, dot(point.position - shade.eye, shade.forward));
}

fn shaded_plain(shading_point: ShadingPoint, lit: Lit, exit_factor: f32) -> Shaded {
    let surface = shading_point.surface;
    var below = lit.entered * surface.colour * exit_factor;
    var reflected = lit.reflected;
    if (METALS) {
        below = below * (1.0 - shading_point.metalness) + shading_point.emission;
        reflected *= mix(vec3f(1.0), surface.colour, shading_point.metalness);
    }
    return Shaded(vec3f(0.0), vec3f(0.0), shade.light_factors.x * below, shade.light_factors.y * reflected, 0.0);
}

// Surface of the skin, or of a part that is not skin.
fn surface_or_part(point: Point, footprint: f32) -> PartSurface {
    if (is_opaque(point)) {
        let index = point.flags >> 8u;
        return part_at(point, shade.material_colour[index].rgb, shade.part_materials[index], footprint);
    }
    return PartSurface(surface_at(point, footprint), 0.0, vec3f(0.0), vec3f(0.0));
}

fn ray_to_position(position: vec2f, size: vec2f) -> vec3f {
    let ndc = vec2f(2.0, -2.0) * position / size + vec2f(-1.0, 1.0);
    return shade.forward + (ndc.x + shade.shift.x) * shade.right + (ndc.y + shade.shift.y) * shade.up;
}

// coverage: fraction of the pixel that is shaded at once, over which maps are filtered
fn shading_point_at(triangle: u32, position: vec2f, coverage: f32, size: vec2f) -> ShadingPoint {
    let t = triangle_at(triangle);
    let a = corner_at(t.x);
    let b = corner_at(t.y);
    let c = corner_at(t.z);
    let weights = ray_to_weights(shade.eye, a.position, b.position, c.position);
    let w = meet(weights, ray_to_position(position, size));
    let inside = within(w); // a sample on an edge may be slightly outside
    var point = interpolate(a, b, c, inside, t.w);
    point.atlas_uv = atlas_position(triangle, inside);
    point.curvature = curvature_at(t, inside);
    let open = open_sky(point, t, inside);
    let v = normalize(shade.eye - point.position);
    let spacing = sqrt(coverage);
    let wx = meet(weights, ray_to_position(position + vec2f(spacing, 0.0), size)) - w;
    let wy = meet(weights, ray_to_position(position + vec2f(0.0, spacing), size)) - w;
    let footprint = footprint_of(wx.x * a.uv + wx.y * b.uv + wx.z * c.uv, wy.x * a.uv + wy.y * b.uv + wy.z * c.uv);
    let part = surface_or_part(point, footprint);
    let surface = part.surface;
    var texel: TexelAxes;
    if (STRIPE_LIGHT) {
        texel = texel_axes(triangle, a, b, c, f32(textureDimensions(scattered).x));
        // Variance of the positions of the samples that are shaded together.
        let samples = max(1.0, round(coverage * f32(shade.samples)));
        let deviation = sqrt((1.0 - 1.0 / samples) / 12.0);
        area_u = deviation * (wx.x * a.position + wx.y * b.position + wx.z * c.position);
        area_v = deviation * (wy.x * a.position + wy.y * b.position + wy.z * c.position);
    }
    let film = plain_film(surface.normal, vec3f(0.0));
    var shading_point = ShadingPoint(point, surface, film, v, footprint, open, texel, part.metalness, part.emission, part.sheen);
    if (EYES) {
        apply_modelled_parts(&shading_point);
    }
    return shading_point;
}

// Replaces the plain material of modelled eyes, teeth and the tongue.
fn apply_modelled_parts(shading_point: ptr<function, ShadingPoint>) {
    let point = (*shading_point).point;
    // A loop instead of a branch: software adapters run both sides of a branch for all pixels.
    var k = 0u;
    loop {
        if (!is_opaque(point) || k >= 2u) {
            break;
        }
        let material = shade.material_colour[point.flags >> 8u];
        if (material.w > 0.0) {
            let hidden = select(vec3f(0.0), shade.teeth_below_lip, material.w == TONGUE);
            (*shading_point).open = open_between_lips(point.position, point.normal, hidden, (*shading_point).open);
            (*shading_point).surface = mouth_at(point, material, shade.tongue);
            let scattered = mouth_shadow_scatter(material.w, (*shading_point).open, shade.lips[0].w);
            (*shading_point).film = plain_film((*shading_point).surface.normal, scattered);
            (*shading_point).film.ambient = ambient_among_lining((*shading_point).surface.colour, (*shading_point).open);
            (*shading_point).point.lit_position += TOOTH_SHADOW_OFFSET_MM * point.normal;
            break;
        }
        if (shade.eyes[k].material == (point.flags >> 8u)) {
            let own = (shade.eyes[k].to_own * vec4f(point.position, 1.0)).xyz;
            let lids = lids_around(k, own);
            let eye = eye_at(shade.eyes[k], own, lids, (*shading_point).v, shade.skin_albedo);
            (*shading_point).surface = eye.surface;
            (*shading_point).film = eye.film;
            (*shading_point).point.lit_position += SHADOW_OFFSET_MM * eye.film.normal;
            break;
        }
        k++;
    }
}

fn lit_at(shading_point: ShadingPoint) -> Lit {
    //#if METALS
    metalness = shading_point.metalness;
    //#end
    //#if WORN
    sheen = shading_point.sheen;
    //#end
    // The only call: software adapters run both sides of a branch for all pixels.
    return illuminate_film(shading_point.point, shading_point.surface, shading_point.film, shading_point.v, shading_point.open);
}

fn shaded(shading_point: ShadingPoint, lit: Lit) -> Shaded {
    let exit_factor = leaves(dot(shading_point.film.normal, shading_point.v), shading_point.surface.roughness, shading_point.surface.rho_s) / PI;
    if (is_opaque(shading_point.point)) {
        return shaded_plain(shading_point, lit, exit_factor);
    }
    return shaded_skin(shading_point, lit, exit_factor);
}
