// A level whose texels every GPU can filter.

@group(0) @binding(30) var source: texture_2d<f32>; // filtered; light, and 1 where there is surface
@group(0) @binding(31) var linear: sampler;

fn source_at(uv: vec2f) -> vec4f {
    return textureSampleLevel(source, linear, uv, 0.0);
}

// Between two texels of a row; whole numbers are texel centres.
fn source_between(at: vec2f) -> vec4f {
    return source_at((at + 0.5) * (1.0 / vec2f(textureDimensions(source))));
}
