// How far the points that pixels see have moved in the picture since the scene before.
//#include "seen.wgsl"
//#include "planes.wgsl"

//#each motion_outputs: override {NAME}_FIRST: u32 = UNASKED;

struct Before {
    rays: Rays,
}

@group(0) @binding(53) var<uniform> before: Before;
@group(0) @binding(54) var before_table: texture_2d<f32>; // as vertex_table
@group(0) @binding(55) var<storage, read> before_buffer: array<vec4f>; // as vertex_buffer

fn place_before(vertex: u32) -> vec3f {
    if (MESH_IN_BUFFERS) {
        return before_buffer[4u * vertex].xyz;
    }
    return textureLoad(before_table, vertex_texel(vertex), 0).xyz;
}

fn place_now(vertex: u32) -> vec3f {
    return position_of(vertex);
}

fn motion_output(seen: Seen) -> vec2f {
    let w = seen.weights;
    let t = seen.corners;
    let size = vec2f(textureDimensions(centres));
    let now = w.x * place_now(t.x) + w.y * place_now(t.y) + w.z * place_now(t.z);
    let then = w.x * place_before(t.x) + w.y * place_before(t.y) + w.z * place_before(t.z);
    return projected(look.rays, now, size).xy - projected(before.rays, then, size).xy;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(centres);
    if (any(id.xy >= size)) {
        return;
    }
    let seen = seen_at(id.xy, size);
    let there = sees_any(id.xy);
    let cell = cell_of(id.xy, size);
    //#each motion_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(seen), there)); }}
}
