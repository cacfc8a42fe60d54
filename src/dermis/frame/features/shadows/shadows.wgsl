// Visibility of a light from a point, read from the light's shadow map.

// The point is moved off the surface by the width of the filter to avoid self-shadowing.
fn visibility(light: Light, point: Point, l: vec3f) -> f32 {
    if (light.layer < 0) {
        return 1.0;
    }
    if (SHAPES && light.extent.x > 0.0) {
        return soft_visibility(light, point);
    }
    var texel = light.texel;
    if (!is_parallel(light)) {
        texel *= distance(light.position, point.position);
    }
    let cosine = clamp(dot(point.normal, l), 0.0, 1.0);
    let reach = texel * f32(light.half_width);
    let lifted = point.lit_position + point.normal * (reach * sqrt(1.0 - cosine * cosine)) + l * (0.75 * reach);
    let clip = light.to_map * vec4f(lifted, 1.0);
    if (clip.w <= 0.0) {
        return 1.0;
    }
    let ndc = clip.xyz / clip.w;
    return filtered_depth(light, vec2f(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y), ndc.z);
}

// Percentage-closer filtering [Reeves1987] under a tent, 4 x 4 texels at a time, so that their loads overlap.
fn filtered_depth(light: Light, uv: vec2f, depth: f32) -> f32 {
    let size = vec2f(textureDimensions(shadow_maps));
    let texel = 1.0 / size;
    let position = uv * size - 0.5;
    let base = floor(position);
    let f = position - base;
    let h = i32(light.half_width);
    let width = f32(h);
    let columns = vec4f(0.0, 1.0, 2.0, 3.0);
    var lit = 0.0;
    var j = 1 - h; // loops with their test at the end, as in lighting.wgsl
    loop {
        let wy = max(vec4f(0.0), width - abs(f32(j) + columns - f.y));
        var i = 1 - h;
        loop {
            let wx = max(vec4f(0.0), width - abs(f32(i) + columns - f.x));
            let corner = (base + vec2f(f32(i), f32(j)) + 1.0) * texel;
            let a = quad_at(light, corner);
            let b = quad_at(light, corner + vec2f(2.0 * texel.x, 0.0));
            let c = quad_at(light, corner + vec2f(0.0, 2.0 * texel.y));
            let d = quad_at(light, corner + 2.0 * texel);
            lit += unoccluded(a, depth, wx.xy, wy.xy) + unoccluded(b, depth, wx.zw, wy.xy);
            lit += unoccluded(c, depth, wx.xy, wy.zw) + unoccluded(d, depth, wx.zw, wy.zw);
            i += 4;
            if (i > h) {
                break;
            }
        }
        j += 4;
        if (j > h) {
            break;
        }
    }
    return lit / (width * width * width * width);
}

// The four texels around a corner.
fn quad_at(light: Light, corner: vec2f) -> vec4f {
    return textureGather(0, shadow_maps, nearest_sampler, corner, light.layer);
}

// Unoccluded fraction of a quad, weighted by column and row; gather returns its texels in the order (0,1) (1,1) (1,0) (0,0).
fn unoccluded(nearest: vec4f, depth: f32, wx: vec2f, wy: vec2f) -> f32 {
    let visible = select(vec4f(0.0), vec4f(1.0), nearest <= vec4f(depth));
    return dot(visible, vec4f(wx.x * wy.y, wx.y * wy.y, wx.y * wy.x, wx.x * wy.x));
}

// Depth along the axis of the map [mm] for a value of the map.
fn depth_of(light: Light, nearness: f32) -> f32 {
    if (is_parallel(light)) {
        return mix(light.map_far, light.map_near, nearness);
    }
    return light.map_near * light.map_far / (nearness * (light.map_far - light.map_near) + light.map_near);
}
