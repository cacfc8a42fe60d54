// Relief and colour of a face with an expression: folds deepen, and the blood content changes.

struct Expression {
    folding: array<vec4f, 2>, // amounts of the movements that deepen folds, and last of the flush
    pressed: f32, // amount by which blood is pressed out of the lips
    side: u32, // of the maps [texels]
}

// Factors by which a full flush, and a full loss of blood, multiply the skin colour: artistic values.
const FLUSH: vec3f = vec3f(0.97, 0.80, 0.82);
const PALE: vec3f = vec3f(1.08, 1.22, 1.20);

@group(0) @binding(0) var<uniform> expression: Expression;
@group(0) @binding(1) var colour_at_rest: texture_2d<f32>;
@group(0) @binding(2) var expression_deltas: texture_2d_array<f32>; // heights that full movements add [mm], and last the gain or loss of blood
@group(0) @binding(3) var<storage, read> heights_at_rest: array<f32>; // with a border of one texel [mm]
@group(0) @binding(4) var<storage, read_write> heights: array<f32>;
@group(0) @binding(5) var colour: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(expression.side))) {
        return;
    }
    let first = textureLoad(expression_deltas, id.xy, 0, 0);
    let second = textureLoad(expression_deltas, id.xy, 1, 0);
    let amount = expression.folding;
    let index = (id.y + 1u) * (expression.side + 2u) + id.x + 1u;
    heights[index] = heights_at_rest[index] + dot(amount[0], first) + dot(amount[1].xyz, second.xyz);
    let flushed = pow(FLUSH, vec3f(amount[1].w * max(second.w, 0.0)));
    let pale = pow(PALE, vec3f(expression.pressed * max(-second.w, 0.0)));
    let rest = textureLoad(colour_at_rest, id.xy, 0);
    textureStore(colour, id.xy, vec4f(rest.rgb * flushed * pale, rest.a));
}
