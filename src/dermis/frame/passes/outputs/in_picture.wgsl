// Where places are in the picture that an eye sees.

fn in_picture(rays: Rays, p: vec3f, size: vec2f) -> vec2f {
    let way = p - rays.eye;
    let across = vec2f(dot(way, rays.right) / dot(rays.right, rays.right), dot(way, rays.up) / dot(rays.up, rays.up));
    let ndc = across / dot(way, rays.forward) - rays.shift;
    return (0.5 + vec2f(0.5, -0.5) * ndc) * size;
}
