// Sum of the uv where the centre of each pixel meets the mesh.

fn uv_sum_output(seen: Seen) -> f32 {
    return seen.point.uv.x + seen.point.uv.y;
}
