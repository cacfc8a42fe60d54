// Camera and projected knots: position and width in the picture, and radiance.

struct StrandView {
    eye: vec3f,
    samples: u32, // per pixel
    forward: vec3f,
    coarse: u32, // number of coarse strands that are drawn
    right: vec3f, // scaled as in shading.wgsl
    up: vec3f,
    shift: vec2f, // of the picture's middle from the axis, in half pictures
    light_factors: vec2f, // of light from below the skin and of reflected light; that of hair counts as reflected
    size: vec2f, // of the picture [pixel]
    skin: vec3f, // albedo of the skin below the strands
    jitter: array<vec4f, 64>, // positions of samples in the pixel, 0..1
}

// A knot in the picture.
struct ProjectedKnot {
    position: vec2f, // [pixel]
    depth: f32, // along the view [mm]
    width: f32, // [pixel], negative behind the eye, and where the head hides the whole strand
    radiance: vec3f,
    covered: u32, // whether other hair or the head hides the segment that begins here
}

@group(0) @binding(40) var<uniform> strand_view: StrandView;

fn project_knot(p: vec3f, radius: f32) -> ProjectedKnot {
    let offset = p - strand_view.eye;
    let depth = dot(offset, strand_view.forward);
    let right = strand_view.right;
    let up = strand_view.up;
    let ndc = vec2f(dot(offset, right) / dot(right, right), dot(offset, up) / dot(up, up)) / max(depth, 1e-3);
    let position = (0.5 + vec2f(0.5, -0.5) * (ndc - strand_view.shift)) * strand_view.size;
    let width = radius * strand_view.size.y / (length(up) * max(depth, 1e-3));
    return ProjectedKnot(position, depth, select(-1.0, width, depth > 1.0), vec3f(0.0), 0u);
}
