// Light read from a pyramid level, interpolated by the sampler or in the shader.
//#if FILTERED_SOURCE
// Level in a format that all GPUs can filter.

@group(0) @binding(30) var source: texture_2d<f32>; // filtered; light, alpha is 1 on the surface
@group(0) @binding(31) var linear: sampler;

fn source_at(uv: vec2f) -> vec4f {
    return textureSampleLevel(source, linear, uv, 0.0);
}

// Light between two texels of a row; integers are texel centres.
fn source_between(at: vec2f) -> vec4f {
    return source_at((at + 0.5) * (1.0 / vec2f(textureDimensions(source))));
}
//#else
// Level in a format that many GPUs cannot filter.
//#include "bilinear.wgsl"

@group(0) @binding(30) var source: texture_2d<f32>; // light; alpha is 1 on the surface

fn source_at(uv: vec2f) -> vec4f {
    return load_bilinear(source, uv);
}

// Light between two texels of a row; integers are texel centres.
fn source_between(at: vec2f) -> vec4f {
    let most = vec2i(textureDimensions(source)) - 1;
    let left = vec2i(vec2f(floor(at.x), at.y));
    let a = textureLoad(source, clamp(left, vec2i(0), most), 0);
    let b = textureLoad(source, clamp(left + vec2i(1, 0), vec2i(0), most), 0);
    return mix(a, b, fract(at.x));
}
//#end
