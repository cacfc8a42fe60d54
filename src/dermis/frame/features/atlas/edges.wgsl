// Distance to the nearest seam [mm].

// texels : distance to the edge of the chart [texels]
fn edge_mm(texels: f32, per_mm: vec2f) -> f32 {
    return texels / max(sqrt(per_mm.x * per_mm.y), 1e-3);
}
