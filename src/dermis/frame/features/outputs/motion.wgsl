// How far the points that pixels see have moved in the picture since the scene before.
//#include "each_hit.wgsl"

//#include <motion_outputs>
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

fn mixed(w: vec3f, a: vec3f, b: vec3f, c: vec3f) -> vec3f {
    return w.x * a + w.y * b + w.z * c;
}

// Not the difference of pixels, which is not 0 for equal ones where a product and the difference are rounded as one.
fn motion_output(seen: Seen) -> vec2f {
    let t = seen.corners;
    let now = mixed(seen.weights, position_of(t.x), position_of(t.y), position_of(t.z));
    let then = mixed(seen.weights, place_before(t.x), place_before(t.y), place_before(t.z));
    let moved = in_picture(look.rays, now).xy - in_picture(before.rays, then).xy;
    return vec2f(0.5, -0.5) * moved * vec2f(textureDimensions(centres));
}

fn put_seen(seen: Seen, there: bool, cell: Cell) {
    //#each motion_outputs: if ({NAME}_FIRST != UNASKED) {{ put_{type}({NAME}_FIRST, cell, select({nothing}, {name}_output(seen), there)); }}
}
