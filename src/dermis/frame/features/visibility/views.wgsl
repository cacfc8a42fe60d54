// Views of cameras and lights, for passes that find the nearest surface.

struct Views {
    clip: array<mat4x4f, 64>, // world to clip space, depth 1 near to 0 far
    sample: array<vec4f, 64>, // positions of the samples in a pixel, one layer of a view for each; for the compute pass
    sample_bounds: vec4f, // least and greatest position of a sample
    triangles: u32,
    width: u32,
    height: u32,
    index_bits: u32, // bits of the triangle below the depth in a word; 0 if both have their own buffer
}

@group(0) @binding(30) var<uniform> views: Views;
