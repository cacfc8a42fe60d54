// Light that is finer than the atlas' texels, where its shape is known: stripes. Of the blurred levels of such a light the atlas
// holds what its texels can, read between them; here is what that lacks at a place of the picture, by the same Gaussians.

struct Fine {
    count: u32, // of levels; 0 for none
    texel_variance: f32, // over which texels average light [texel^2]
    relit_mm2: f32, // variance of the level that is not blurred
    //#fill level: array<vec4f, {fine_levels}>, // weight, variance [mm^2]
}

// How the atlas lies on a triangle's plane: mm for a texel along u and v.
struct TexelAxes {
    u: vec3f,
    v: vec3f,
}

fn texel_axes(triangle: u32, a: Corner, b: Corner, c: Corner, side: f32) -> TexelAxes {
    let ab = bitcast<vec4f>(triangle_row(triangle, 1u));
    let ac = bitcast<vec4f>(triangle_row(triangle, 2u)).xy - ab.xy;
    let to_b = side * (ab.zw - ab.xy);
    let to_c = side * ac;
    let det = to_b.x * to_c.y - to_b.y * to_c.x;
    let scale = select(0.0, 1.0 / det, abs(det) > 1e-9);
    let p = scale * (b.position - a.position);
    let q = scale * (c.position - a.position);
    return TexelAxes(to_c.y * p - to_b.y * q, to_b.x * q - to_c.x * p);
}

// Irradiance that entered, spread by the profile, beyond what the atlas shows of it here.
// held: of the level that is not blurred, weight
fn finer_light(point: Point, surface: Surface, axes: TexelAxes, fine: Fine, held: vec3f, side: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    let f = fract(point.place * side - 0.5);
    var i = 0u;
    loop {
        if (i >= skin.light_count || fine.count == 0u) {
            break;
        }
        let light = lights.light[i];
        let cosine = -dot(surface.normal, light.direction);
        if (light.sheet != 0u && cosine > 0.0) {
            var entering = light.irradiance * (cosine * enters(cosine, surface.roughness, surface.rho_s));
            entering *= stripe_along(light, point.position) * reaching(light, point, -light.direction);
            if (HALF_SPACE) {
                entering *= coming_back(cosine);
            }
            sum += entering * finer_stripe(light, point, axes, fine, held, f);
        }
        i++;
    }
    return sum;
}

fn finer_stripe(light: Light, point: Point, axes: TexelAxes, fine: Fine, held: vec3f, f: vec2f) -> vec3f {
    let here = dot(point.position - light.position, light.half_u);
    let step = vec2f(dot(axes.u, light.half_u), dot(axes.v, light.half_u));
    let along = light.half_u - dot(light.half_u, point.normal) * point.normal;
    let per_mm2 = dot(along, along);
    let seen = area_variance(light.half_u);
    let texel = fine.texel_variance * dot(step, step);
    let first = here - dot(f, step);
    let w = bilinear_weights(f);
    var sum = held * (stripe_across(here, seen + fine.relit_mm2 * per_mm2) - stripe_across(here, seen));
    var k = 0u;
    loop {
        let level = fine.level[k];
        let spread = level.w * per_mm2;
        let held_there = vec4f(
            stripe_across(first, texel + spread), stripe_across(first + step.x, texel + spread),
            stripe_across(first + step.y, texel + spread), stripe_across(first + step.x + step.y, texel + spread),
        );
        sum += level.rgb * (stripe_across(here, seen + spread) - dot(w, held_there));
        k++;
        if (k >= fine.count) {
            break;
        }
    }
    return sum;
}
