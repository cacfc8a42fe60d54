// How the eye sees hairs: knots in the picture, their width there and the light that leaves them.

struct StrandView {
    eye: vec3f,
    samples: u32, // in a pixel
    forward: vec3f,
    coarse: u32, // coarse hairs that stand for all
    right: vec3f, // scaled as in shade.wgsl
    up: vec3f,
    shift: vec2f, // of the picture's middle from the axis, in half pictures
    shown: vec2f, // factors of light from below the skin and of reflected light, which that of hairs counts as
    size: vec2f, // of the picture [pixel]
    wider: f32, // than they are, for coarse hairs to cover what all do
    skin: vec3f, // albedo of the skin under the hairs
    jitter: array<vec4f, 64>, // sample places in the pixel, 0..1
}

// A knot as it is drawn.
struct Drawn {
    place: vec2f, // [pixel]
    depth: f32, // along the view [mm]
    width: f32, // [pixel], negative behind the eye
    radiance: vec3f,
}

@group(0) @binding(40) var<uniform> strand_view: StrandView;

fn seen_at(p: vec3f, radius: f32) -> Drawn {
    let way = p - strand_view.eye;
    let depth = dot(way, strand_view.forward);
    let right = strand_view.right;
    let up = strand_view.up;
    let ndc = vec2f(dot(way, right) / dot(right, right), dot(way, up) / dot(up, up)) / max(depth, 1e-3);
    let place = (0.5 + vec2f(0.5, -0.5) * (ndc - strand_view.shift)) * strand_view.size;
    let width = radius * strand_view.size.y / (length(up) * max(depth, 1e-3));
    return Drawn(place, depth, select(-1.0, width, depth > 1.0), vec3f(0.0));
}
