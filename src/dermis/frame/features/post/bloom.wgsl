// One step of the bloom: halves a picture by a binomial filter, or adds a smaller picture, enlarged.
//#include "bilinear.wgsl"

override WIDEN: bool = false; // false: halve; true: add the smaller picture

struct Bloom {
    own: f32, // factors of the picture and of the smaller one
    wider: f32,
}

@group(0) @binding(0) var<uniform> bloom: Bloom;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var smaller: texture_2d<f32>;
@group(0) @binding(3) var result: texture_storage_2d<rgba32float, write>;

// Filter 1 3 3 1 along both axes: a Gaussian pyramid [BurtAdelson1983] with samples between four pixels.
fn halved(at: vec2i) -> vec4f {
    let last = vec2i(textureDimensions(picture)) - 1;
    var sum = vec4f(0.0);
    for (var j = -1; j < 3; j++) {
        for (var i = -1; i < 3; i++) {
            let weight = select(1.0, 3.0, i == 0 || i == 1) * select(1.0, 3.0, j == 0 || j == 1);
            sum += weight / 64.0 * textureLoad(picture, clamp(2 * at + vec2i(i, j), vec2i(0), last), 0);
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(result);
    if (any(id.xy >= size)) {
        return;
    }
    if (!WIDEN) {
        textureStore(result, id.xy, halved(vec2i(id.xy)));
        return;
    }
    let own = textureLoad(picture, id.xy, 0);
    let wide = load_bilinear(smaller, (vec2f(id.xy) + 0.5) / vec2f(size));
    textureStore(result, id.xy, vec4f(bloom.own * own.rgb + bloom.wider * wide.rgb, own.a));
}
