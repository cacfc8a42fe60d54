// The open share of the sky as a head is now: the map of its rest, on the atlas and at vertices, changed as between the vertices.

const MOST_GAIN: f32 = 2.0; // of a texel over its vertices: more would be their noise

@group(0) @binding(0) var corners: texture_2d<u32>; // three vertices and two barycentric weights packed
@group(0) @binding(1) var resting_map: texture_2d<f32>; // the atlas, its last row again, the vertices
@group(0) @binding(2) var<storage, read> shares: array<vec2f>; // open at vertices, at rest and now
@group(0) @binding(3) var moved_map: texture_storage_2d<r32float, write>;

// What opens gives back its share of what was hidden, what closes takes its share of what was open.
fn moved(open: f32, share: vec2f) -> f32 {
    let closes = share.y < share.x;
    let gain = select((1.0 - open) / max(1.0 - share.x, 1e-6), open / max(share.x, 1e-6), closes);
    return clamp(open + (share.y - share.x) * min(gain, MOST_GAIN), 0.0, 1.0);
}

@compute @workgroup_size(16, 16)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(moved_map);
    if (any(id.xy >= size)) {
        return;
    }
    let side = size.x;
    let open = textureLoad(resting_map, id.xy, 0).x;
    var share = vec2f(1.0);
    if (id.y > side) {
        share = shares[min((id.y - side - 1u) * side + id.x, arrayLength(&shares) - 1u)];
    } else {
        let corner = textureLoad(corners, vec2u(id.x, min(id.y, side - 1u)), 0);
        let w = unpack2x16unorm(corner.w);
        if (corner.x < arrayLength(&shares)) {
            share = (1.0 - w.x - w.y) * shares[corner.x] + w.x * shares[corner.y] + w.y * shares[corner.z];
        }
    }
    textureStore(moved_map, id.xy, vec4f(moved(open, share)));
}
