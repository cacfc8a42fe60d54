// Records the nearest surface of each sample by atomic maxima, so that the order in which triangles are drawn does not matter.
//#include "views.wgsl"

override RECORDED: u32 = 0u; // what is recorded of a sample

const AS_DEPTH: u32 = 0u; // the bits of its depth
const AS_FOUND: u32 = 1u; // its triangle, where its depth is the one recorded before
const AS_BOTH: u32 = 2u; // its depth in fewer bits above its triangle
const ROUNDING: u32 = 4u; // depths are computed twice and may be rounded differently

@group(0) @binding(31) var<storage, read_write> nearness: array<atomic<u32>>; // depth, or depth and triangle + 1; 0 empty
@group(0) @binding(32) var<storage, read_write> found: array<atomic<u32>>; // triangle + 1

// Of two triangles at one depth the later one wins, in any order.
fn record_four(index: u32, depth: vec4f, inside: vec4<bool>, texels: vec4u) {
    var near = bitcast<vec4u>(depth); // positive floats sort like their bits
    if (RECORDED == AS_FOUND) {
        record_found(index, near, inside, texels);
        return;
    }
    if (RECORDED == AS_BOTH) {
        let most = f32((1u << (32u - views.index_bits)) - 1u);
        near = (vec4u(depth * most) << vec4u(views.index_bits)) | vec4u(index + 1u);
    }
    record_near(inside.x, texels.x, near.x);
    record_near(inside.y, texels.y, near.y);
    record_near(inside.z, texels.z, near.z);
    record_near(inside.w, texels.w, near.w);
}

fn record_near(inside: bool, texel: u32, near: u32) {
    if (inside) {
        atomicMax(&nearness[texel], near);
    }
}

fn record_found(index: u32, near: vec4u, inside: vec4<bool>, texels: vec4u) {
    let nearest = vec4u( // loaded together, so that the loads overlap
        nearest_at(inside.x, texels.x),
        nearest_at(inside.y, texels.y),
        nearest_at(inside.z, texels.z),
        nearest_at(inside.w, texels.w),
    );
    let seen = inside & (near + ROUNDING >= nearest);
    record_triangle(seen.x, texels.x, index);
    record_triangle(seen.y, texels.y, index);
    record_triangle(seen.z, texels.z, index);
    record_triangle(seen.w, texels.w, index);
}

fn nearest_at(inside: bool, texel: u32) -> u32 {
    if (inside) {
        return atomicLoad(&nearness[texel]);
    }
    return 0u;
}

fn record_triangle(seen: bool, texel: u32, index: u32) {
    if (seen) {
        atomicMax(&found[texel], index + 1u);
    }
}
