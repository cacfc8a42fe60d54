// Correction for light that varies within a texel of the atlas, for light stripes, whose shape is known: the exact convolution
// by the Gaussians of the profile minus the interpolated levels of the atlas.

struct Fine {
    count: u32, // number of levels, 0 for none
    texel_variance: f32, // of the filter of light on the atlas [texels^2]
    unblurred_mm2: f32, // variance of the unblurred Gaussian [mm^2]
    //#fill level: array<vec4f, {fine_levels}>, // weight, variance [mm^2]
}

// Vectors of a texel of the atlas in the plane of a triangle, along u and v [mm].
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

// Scattered irradiance minus its value on the atlas.
// unblurred_weight : weight of the unblurred Gaussian
fn light_finer_than_texels(point: Point, surface: Surface, axes: TexelAxes, fine: Fine, unblurred_weight: vec3f, side: vec2f) -> vec3f {
    var sum = vec3f(0.0);
    let f = fract(point.atlas_uv * side - 0.5);
    var i = 0u;
    loop {
        if (i >= skin.light_count || fine.count == 0u) {
            break;
        }
        let light = lights.light[i];
        let cosine = -dot(surface.normal, light.direction);
        if (light.sheet != 0u && cosine > 0.0) {
            var entering = light.irradiance * (cosine * enters(cosine, surface.roughness, surface.rho_s));
            entering *= stripe_along(light, point.position) * total_visibility(light, point, -light.direction);
            if (HALF_SPACE) {
                entering *= relative_reflectance(cosine);
            }
            sum += entering * stripe_finer_than_texels(light, point, axes, fine, unblurred_weight, f);
        }
        i++;
    }
    return sum;
}

fn stripe_finer_than_texels(light: Light, point: Point, axes: TexelAxes, fine: Fine, unblurred_weight: vec3f, f: vec2f) -> vec3f {
    let here = dot(point.position - light.position, light.half_u);
    let step = vec2f(dot(axes.u, light.half_u), dot(axes.v, light.half_u));
    let along = light.half_u - dot(light.half_u, point.normal) * point.normal;
    let per_mm2 = dot(along, along);
    let seen = area_variance(light.half_u);
    let texel = fine.texel_variance * dot(step, step);
    let first = here - dot(f, step);
    let w = bilinear_weights(f);
    var sum = unblurred_weight * (stripe_across(here, seen + fine.unblurred_mm2 * per_mm2) - stripe_across(here, seen));
    var k = 0u;
    loop {
        let level = fine.level[k];
        let spread = level.w * per_mm2;
        let interpolated = vec4f(
            stripe_across(first, texel + spread), stripe_across(first + step.x, texel + spread),
            stripe_across(first + step.y, texel + spread), stripe_across(first + step.x + step.y, texel + spread),
        );
        sum += level.rgb * (stripe_across(here, seen + spread) - dot(w, interpolated));
        k++;
        if (k >= fine.count) {
            break;
        }
    }
    return sum;
}
