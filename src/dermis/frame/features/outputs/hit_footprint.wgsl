// Area of the maps that a pixel covers, for outputs.
//#include "surface_hit.wgsl"
//#include "shading/footprint.wgsl"

// Footprint of the whole pixel.
fn footprint_at(hit: SurfaceHit) -> f32 {
    let size = vec2f(textureDimensions(centres));
    let a = corner_at(hit.corners.x);
    let b = corner_at(hit.corners.y);
    let c = corner_at(hit.corners.z);
    let weights = ray_to_weights(camera.rays.eye, a.position, b.position, c.position);
    let position = vec2f(hit.pixel) + 0.5;
    let w = meet(weights, ray_to(camera.rays, position, size));
    let wx = meet(weights, ray_to(camera.rays, position + vec2f(1.0, 0.0), size)) - w;
    let wy = meet(weights, ray_to(camera.rays, position + vec2f(0.0, 1.0), size)) - w;
    return footprint_of(wx.x * a.uv + wx.y * b.uv + wx.z * c.uv, wy.x * a.uv + wy.y * b.uv + wy.z * c.uv);
}
