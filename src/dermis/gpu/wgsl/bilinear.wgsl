// Bilinear interpolation of textures that samplers cannot filter (32-bit floats on many GPUs).

fn bilinear_weights(texel: vec2f) -> vec4f {
    let f = texel - floor(texel);
    let g = 1.0 - f;
    return vec4f(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y);
}

fn load_bilinear(image: texture_2d<f32>, uv: vec2f) -> vec4f {
    let size = vec2i(textureDimensions(image));
    let texel = uv * vec2f(size) - 0.5;
    let a = clamp(vec2i(floor(texel)), vec2i(0), size - 1);
    let b = clamp(vec2i(floor(texel)) + 1, vec2i(0), size - 1);
    let w = bilinear_weights(texel);
    return w.x * textureLoad(image, a, 0)
        + w.y * textureLoad(image, vec2i(b.x, a.y), 0)
        + w.z * textureLoad(image, vec2i(a.x, b.y), 0)
        + w.w * textureLoad(image, b, 0);
}
