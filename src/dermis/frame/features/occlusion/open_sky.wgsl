// Sky visibility at a point of a triangle, read from the atlas or interpolated between the corners of the triangle.
//#include "irradiance/lighting.wgsl"

// t: corners of the triangle, w: barycentric weights
fn open_sky(point: Point, t: vec4u, w: vec3f) -> f32 {
    if (!ENVIRONMENT) {
        return 1.0;
    }
    if ((t.w & MAPPED) != 0u) {
        return open_at(point.atlas_uv);
    }
    return dot(w, vec3f(open_at_vertex(t.x), open_at_vertex(t.y), open_at_vertex(t.z)));
}
