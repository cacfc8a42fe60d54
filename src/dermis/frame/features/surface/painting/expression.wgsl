// Relief and colour of a face that moves: folds deepen, blood comes and goes.

struct Expression {
    folding: array<vec4f, 2>, // how far each movement is made; in the last place flush
    pressed: f32, // out of the lips
    side: u32, // of the maps [texels]
}

// Colour of skin after over before a full flush, and when the blood is pressed out: artist's values.
const FLUSH: vec3f = vec3f(0.97, 0.80, 0.82);
const PALE: vec3f = vec3f(1.08, 1.22, 1.20);

@group(0) @binding(0) var<uniform> expression: Expression;
@group(0) @binding(1) var resting: texture_2d<f32>; // colour at rest
@group(0) @binding(2) var moved: texture_2d_array<f32>; // height that full movements add [mm]; where blood comes to, or leaves
@group(0) @binding(3) var<storage, read> at_rest: array<f32>; // heights, with a texel more on all sides [mm]
@group(0) @binding(4) var<storage, read_write> heights: array<f32>;
@group(0) @binding(5) var colour: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(expression.side))) {
        return;
    }
    let first = textureLoad(moved, id.xy, 0, 0);
    let second = textureLoad(moved, id.xy, 1, 0);
    let made = expression.folding;
    let place = (id.y + 1u) * (expression.side + 2u) + id.x + 1u;
    heights[place] = at_rest[place] + dot(made[0], first) + dot(made[1].xyz, second.xyz);
    let flushed = pow(FLUSH, vec3f(made[1].w * max(second.w, 0.0)));
    let pale = pow(PALE, vec3f(expression.pressed * max(-second.w, 0.0)));
    let rest = textureLoad(resting, id.xy, 0);
    textureStore(colour, id.xy, vec4f(rest.rgb * flushed * pale, rest.a));
}
