// Where cameras and lights stand, for the passes that find the nearest surface.

struct Views {
    clip: array<mat4x4f, 64>, // world to clip space, depth 1 near to 0 far
    sample: array<vec4f, 64>, // samples in a pixel, a layer of each view for each; for the compute pass
    reach: vec4f, // least and greatest of them
    triangles: u32,
    width: u32,
    height: u32,
    index_bits: u32, // bits of a triangle below its depth in one word, 0 where each has a buffer of its own
}

@group(0) @binding(30) var<uniform> views: Views;
