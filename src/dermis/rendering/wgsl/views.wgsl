// Where cameras and lights stand, for the passes that find the nearest surface.

struct Views {
    clip: array<mat4x4f, 64>, // world to clip space, depth 0 near to 1 far
    triangles: u32,
    pitch: u32, // pixels from one row of a layer to the next
    width: u32,
    height: u32,
}

@group(1) @binding(0) var<uniform> views: Views;
