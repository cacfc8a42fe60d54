// How much of the maps a pixel shows.
//#include "surface_hit.wgsl"
//#include "shading/footprint.wgsl"

// Of the whole pixel.
fn footprint_at(seen: Seen) -> f32 {
    let size = vec2f(textureDimensions(centres));
    let a = corner_at(seen.corners.x);
    let b = corner_at(seen.corners.y);
    let c = corner_at(seen.corners.z);
    let weights = ray_to_weights(look.rays.eye, a.position, b.position, c.position);
    let place = vec2f(seen.pixel) + 0.5;
    let w = meet(weights, ray_to(look.rays, place, size));
    let wx = meet(weights, ray_to(look.rays, place + vec2f(1.0, 0.0), size)) - w;
    let wy = meet(weights, ray_to(look.rays, place + vec2f(0.0, 1.0), size)) - w;
    return footprint_of(wx.x * a.uv + wx.y * b.uv + wx.z * c.uv, wy.x * a.uv + wy.y * b.uv + wy.z * c.uv);
}
