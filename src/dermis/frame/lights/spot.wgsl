// Point light within a cone that fades towards its edge.
//#include "point.wgsl"

fn spot_incident(light: Light, p: vec3f, part: u32) -> Incident {
    let all = point_incident(light, p, part);
    let fraction = smoothstep(light.cos_outer, light.cos_inner, dot(-all.direction, light.direction));
    return Incident(all.direction, all.irradiance * fraction);
}
