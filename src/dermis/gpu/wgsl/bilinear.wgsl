// Bilinear reading of textures that a sampler may not filter (32-bit floats on many GPUs).

fn bilinear_weights(place: vec2f) -> vec4f {
    let f = place - floor(place);
    let g = 1.0 - f;
    return vec4f(g.x * g.y, f.x * g.y, g.x * f.y, f.x * f.y);
}

fn load_bilinear(image: texture_2d<f32>, uv: vec2f) -> vec4f {
    let size = vec2i(textureDimensions(image));
    let place = uv * vec2f(size) - 0.5;
    let a = clamp(vec2i(floor(place)), vec2i(0), size - 1);
    let b = clamp(vec2i(floor(place)) + 1, vec2i(0), size - 1);
    let w = bilinear_weights(place);
    return w.x * textureLoad(image, a, 0)
        + w.y * textureLoad(image, vec2i(b.x, a.y), 0)
        + w.z * textureLoad(image, vec2i(a.x, b.y), 0)
        + w.w * textureLoad(image, b, 0);
}
