// Records the nearest surface of each sample by atomic maxima, so that the result does not depend on the order of triangles.
//#include "views.wgsl"

override RECORDED: u32 = 0u; // what is recorded of a sample

const AS_DEPTH: u32 = 0u; // bits of the depth
const AS_TRIANGLE: u32 = 1u; // triangle, where its depth is the recorded one
const AS_BOTH: u32 = 2u; // depth in the high bits, triangle in the low bits
const ROUNDING: u32 = 4u; // tolerance, as depths are computed twice and may be rounded differently

@group(0) @binding(31) var<storage, read_write> nearness: array<atomic<u32>>; // depth, or depth and triangle + 1; 0 empty
@group(0) @binding(32) var<storage, read_write> triangle_ids: array<atomic<u32>>; // triangle + 1

// Of two triangles at one depth the one with the higher index wins.
fn record_four(index: u32, depth: vec4f, inside: vec4<bool>, texels: vec4u) {
    var depth_bits = bitcast<vec4u>(depth); // bits of positive floats sort like the floats
    if (RECORDED == AS_TRIANGLE) {
        record_triangles(index, depth_bits, inside, texels);
        return;
    }
    if (RECORDED == AS_BOTH) {
        let max_depth = f32((1u << (32u - views.index_bits)) - 1u);
        depth_bits = (vec4u(depth * max_depth) << vec4u(views.index_bits)) | vec4u(index + 1u);
    }
    record_nearest(inside.x, texels.x, depth_bits.x);
    record_nearest(inside.y, texels.y, depth_bits.y);
    record_nearest(inside.z, texels.z, depth_bits.z);
    record_nearest(inside.w, texels.w, depth_bits.w);
}

fn record_nearest(inside: bool, texel: u32, depth_bits: u32) {
    if (inside) {
        atomicMax(&nearness[texel], depth_bits);
    }
}

fn record_triangles(index: u32, depth_bits: vec4u, inside: vec4<bool>, texels: vec4u) {
    let nearest_bits = vec4u( // loaded together, so that the loads overlap
        nearest_at(inside.x, texels.x),
        nearest_at(inside.y, texels.y),
        nearest_at(inside.z, texels.z),
        nearest_at(inside.w, texels.w),
    );
    let visible = inside & (depth_bits + ROUNDING >= nearest_bits);
    record_triangle(visible.x, texels.x, index);
    record_triangle(visible.y, texels.y, index);
    record_triangle(visible.z, texels.z, index);
    record_triangle(visible.w, texels.w, index);
}

fn nearest_at(inside: bool, texel: u32) -> u32 {
    if (inside) {
        return atomicLoad(&nearness[texel]);
    }
    return 0u;
}

fn record_triangle(visible: bool, texel: u32, index: u32) {
    if (visible) {
        atomicMax(&triangle_ids[texel], index + 1u);
    }
}
