// Motion vectors: displacement in the picture of each visible point since the previous scene, and its depth there.
//#include "each_hit.wgsl"

//#include <motion_outputs>
//#each motion_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

struct Previous {
    rays: Rays,
}

@group(0) @binding(53) var<uniform> previous: Previous;
@group(0) @binding(54) var previous_table: texture_2d<f32>; // see vertex_table
@group(0) @binding(55) var<storage, read> previous_buffer: array<vec4f>; // see vertex_buffer

fn previous_position(vertex: u32) -> vec3f {
    if (MESH_IN_BUFFERS) {
        return previous_buffer[4u * vertex].xyz;
    }
    return textureLoad(previous_table, vertex_texel(vertex), 0).xyz;
}

fn interpolated(w: vec3f, a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return w.x * a + w.y * b + w.z * c;
}

fn position_before(hit: SurfaceHit) -> vec3f {
    let t = hit.corners;
    return interpolated(hit.weights, previous_position(t.x), previous_position(t.y), previous_position(t.z));
}

// The difference is taken before scaling to pixels, so that it is 0 for equal positions despite fused multiply-adds.
fn motion_output(hit: SurfaceHit) -> vec2f {
    let t = hit.corners;
    let now = interpolated(hit.weights, position_of(t.x), position_of(t.y), position_of(t.z));
    let before = position_before(hit);
    let offset = project_ndc(camera.rays, now).xy - project_ndc(previous.rays, before).xy;
    return vec2f(0.5, -0.5) * offset * vec2f(textureDimensions(centres));
}

fn motion_depth_output(hit: SurfaceHit) -> f32 {
    return dot(position_before(hit) - previous.rays.eye, previous.rays.forward);
}

fn write_outputs(hit: SurfaceHit, found_hit: bool, slot: PixelSlot) {
    //#each motion_outputs: if ({NAME}_FIRST != NOT_REQUESTED) {{ write_{type}({NAME}_FIRST, slot, select({nothing}, {name}_output(hit), found_hit)); }}
}
