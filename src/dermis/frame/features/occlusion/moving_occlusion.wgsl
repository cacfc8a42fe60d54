// Sky visibility of a moving head at texels and vertices: the map baked at rest, corrected by the changes at the vertices.

const MAX_GAIN: f32 = 2.0; // largest ratio of the change at a texel to that at its vertices, which limits noise

@group(0) @binding(0) var corners: texture_2d<u32>; // three vertices, packed barycentric weights
@group(0) @binding(1) var rest_map: texture_2d<f32>; // rows of the atlas, the last row repeated, then the vertices
@group(0) @binding(2) var<storage, read> visibility: array<vec2f>; // of vertices, at rest and now
@group(0) @binding(3) var moving_map: texture_storage_2d<r32float, write>;

// Visibility after a change at the vertices: an increase restores the same fraction of what was hidden, a decrease removes the
// same fraction of what was visible.
fn updated_visibility(open: f32, vertex_visibility: vec2f) -> f32 {
    let is_closing = vertex_visibility.y < vertex_visibility.x;
    let gain = select((1.0 - open) / max(1.0 - vertex_visibility.x, 1e-6), open / max(vertex_visibility.x, 1e-6), is_closing);
    return clamp(open + (vertex_visibility.y - vertex_visibility.x) * min(gain, MAX_GAIN), 0.0, 1.0);
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(moving_map);
    if (any(id.xy >= size)) {
        return;
    }
    let side = size.x;
    let open = textureLoad(rest_map, id.xy, 0).x;
    var vertex_visibility = vec2f(1.0);
    if (id.y > side) {
        vertex_visibility = visibility[min((id.y - side - 1u) * side + id.x, arrayLength(&visibility) - 1u)];
    } else {
        let corner = textureLoad(corners, vec2u(id.x, min(id.y, side - 1u)), 0);
        let w = unpack2x16unorm(corner.w);
        if (corner.x < arrayLength(&visibility)) {
            vertex_visibility = (1.0 - w.x - w.y) * visibility[corner.x] + w.x * visibility[corner.y] + w.y * visibility[corner.z];
        }
    }
    textureStore(moving_map, id.xy, vec4f(updated_visibility(open, vertex_visibility)));
}
