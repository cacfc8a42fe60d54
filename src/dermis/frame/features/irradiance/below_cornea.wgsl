// Light that a disc below a cornea, the iris, receives.

// Point of the iris, relative to its radius.
struct BelowCornea {
    position: vec3f, // from the axis of the eye
    axis: vec3f, // of the eye, unit
    share: f32, // fraction of the albedo of the surface that is that of the iris; 0 without an iris
}

const NO_CORNEA: BelowCornea = BelowCornea(vec3f(0.0), vec3f(0.0), 0.0);

// Coefficients of mesh/iris_light.csv: even and odd in the offset towards the light.
//#fill const IRIS_EVEN: array<f32, 7> = array<f32, 7>({iris_direct_0}, {iris_direct_1}, {iris_direct_2}, {iris_direct_3}, {iris_direct_4}, {iris_direct_5}, {iris_direct_6});
//#fill const IRIS_ODD: array<f32, 6> = array<f32, 6>({iris_direct_7}, {iris_direct_8}, {iris_direct_9}, {iris_direct_10}, {iris_direct_11}, {iris_direct_12});
//#fill const IRIS_SKY: vec4f = vec4f({iris_sky_0}, {iris_sky_1}, {iris_sky_2}, {iris_sky_3});

// Irradiance of the iris by light from a direction, relative to the irradiance of a surface that faces the light, without
// reflection at the cornea: a fit to rays through the cornea, see mesh/iris_light.py.
fn iris_irradiance(square: f32, offset: f32, cosine: f32) -> f32 {
    let even = IRIS_EVEN[0] + cosine * (IRIS_EVEN[1] + IRIS_EVEN[2] * cosine);
    let radial = IRIS_EVEN[3] + IRIS_EVEN[4] * cosine + square * (IRIS_EVEN[5] + IRIS_EVEN[6] * cosine);
    let odd = IRIS_ODD[0] + IRIS_ODD[1] * square + IRIS_ODD[2] * cosine + offset * (IRIS_ODD[3] + IRIS_ODD[4] * cosine + IRIS_ODD[5] * offset);
    return max(even + square * radial + offset * odd, 0.0);
}

// Ratio of the irradiance by light from a direction to that without the cornea.
// cosine : of the direction to the normal of the surface
fn light_below_cornea(below: BelowCornea, l: vec3f, cosine: f32) -> f32 {
    let found = iris_irradiance(dot(below.position, below.position), dot(below.position, l), dot(below.axis, l));
    return mix(1.0, found / max(cosine, 0.05), below.share);
}

// Ratio for the light of a uniform sky up to 75 degrees from the axis; the lids hide the rest.
fn sky_below_cornea(below: BelowCornea) -> f32 {
    let square = dot(below.position, below.position);
    let found = IRIS_SKY[0] + square * (IRIS_SKY[1] + square * (IRIS_SKY[2] + square * IRIS_SKY[3]));
    return mix(1.0, max(found, 0.0), below.share);
}
