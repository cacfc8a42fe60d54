// Where cameras and lights stand, for the passes that find the nearest surface.

struct Views {
    clip: array<mat4x4f, 64>, // world to clip space, depth 0 near to 1 far
    sample: array<vec4f, 64>, // places in a pixel that each view is seen at, one layer each; for the compute pass
    reach: vec4f, // least and greatest of them
    triangles: u32,
    width: u32,
    height: u32,
    index_bits: u32, // of a triangle below its depth, 0 where each has a buffer of its own
}

@group(0) @binding(30) var<uniform> views: Views;
