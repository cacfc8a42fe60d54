// Relief of a face with an expression, which deepens folds.

struct Relief {
    folding: array<vec4f, 2>, // amounts of the movements that deepen folds; the last number is not used
    side: u32, // of the maps [texels]
}

@group(0) @binding(0) var<uniform> relief: Relief;
@group(0) @binding(2) var expression_deltas: texture_2d_array<f32>; // heights that movements of weight 1 add [mm]; the last channel is the gain or loss of blood
@group(0) @binding(3) var<storage, read> heights_at_rest: array<f32>; // with a border of one texel [mm]
@group(0) @binding(4) var<storage, read_write> heights: array<f32>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(relief.side))) {
        return;
    }
    let first = textureLoad(expression_deltas, id.xy, 0, 0);
    let second = textureLoad(expression_deltas, id.xy, 1, 0);
    let amount = relief.folding;
    let index = (id.y + 1u) * (relief.side + 2u) + id.x + 1u;
    heights[index] = heights_at_rest[index] + dot(amount[0], first) + dot(amount[1].xyz, second.xyz);
}
