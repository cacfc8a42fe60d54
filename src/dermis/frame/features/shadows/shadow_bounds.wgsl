// Nearest depth in squares of 4, 8, 16, 32 and 64 texels of each shadow map, so that squares without occluders can be skipped.
// The squares of 4 texels are stored on the left; larger squares are stored on their right, one size below the other.

@group(0) @binding(0) var maps: texture_2d_array<f32>;
@group(0) @binding(1) var maps_sampler: sampler; // non-filtering
@group(0) @binding(2) var bounds: texture_storage_2d_array<r32float, write>;

const SIDE: u32 = 16u; // squares of 4 texels along the side of a workgroup

var<workgroup> nearest: array<f32, 256>;

// Nearest depth of 4 x 4 texels; the sampler repeats the edge of the map.
fn nearest_in_square(square: vec2u, layer: u32) -> f32 {
    let size = vec2f(textureDimensions(maps));
    var found = vec4f(0.0);
    for (var k = 0u; k < 4u; k++) {
        let centre = 4.0 * vec2f(square) + vec2f(f32(1u + 2u * (k % 2u)), f32(1u + 2u * (k / 2u)));
        found = max(found, textureGather(0, maps, maps_sampler, centre / size, layer));
    }
    return max(max(found.x, found.y), max(found.z, found.w));
}

@compute @workgroup_size(SIDE, SIDE)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(local_invocation_id) lane: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    let height = textureDimensions(bounds).y;
    var value = nearest_in_square(id.xy, id.z);
    textureStore(bounds, id.xy, id.z, vec4f(value));
    nearest[number] = value;
    for (var level = 1u; level < 5u; level++) {
        workgroupBarrier();
        let next = 1u << (level - 1u);
        if (all(lane.xy % (2u * next) == vec2u(0u))) {
            let below = max(nearest[number + SIDE * next], nearest[number + (SIDE + 1u) * next]);
            value = max(max(value, nearest[number + next]), below);
            nearest[number] = value;
            let corner = vec2u(height, height - 2u * (height >> level));
            textureStore(bounds, corner + (id.xy >> vec2u(level)), id.z, vec4f(value));
        }
    }
}
