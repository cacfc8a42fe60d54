// Hairs over the picture: each pixel keeps the nearest pieces of hair that cover it and lays them over what it shows.
//#include "strand_fragments.wgsl"

override ROWS: u32 = 1u; // pixels of an invocation, one below the other; see `rows_of`

@group(0) @binding(31) var<storage, read> chains: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;
@group(0) @binding(34) var behind: texture_2d<f32>; // radiance and coverage
@group(0) @binding(35) var image: texture_storage_2d<rgba32float, write>;

fn covered(pixel: vec2u, first: u32, under: vec4f) -> vec4f {
    let depths = depths_at(pixel);
    take_none();
    for (var link = first; link != 0u; link = links[link - 1u].y) {
        var one = fragment_of(vec2f(pixel) + 0.5, hold(links[link - 1u].x));
        one.cover *= free_share(one.depth, depths);
        if (one.cover > 0.0) {
            take(one);
        }
    }
    return laid_over(under);
}

fn chain_at(pixel: vec2u) -> u32 {
    return chains[1u + pixel.y / STRAND_TILE * tiles_across(strand_view.size) + pixel.x / STRAND_TILE];
}

// The next pixel of a strip that hairs may cover; those before it stay as they are.
fn next_covered(first: vec2u, end: u32) -> vec2u {
    var at = first;
    loop {
        if (at.y >= end || chain_at(at) != 0u) {
            break;
        }
        textureStore(image, at, textureLoad(behind, at, 0));
        at.y += 1u;
    }
    return at;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(image);
    let first = vec2u(id.x, id.y * ROWS);
    if (any(first >= size)) {
        return;
    }
    let end = min(first.y + ROWS, size.y);
    var at = next_covered(first, end);
    if (at.y >= end) {
        return;
    }
    loop {
        textureStore(image, at, covered(at, chain_at(at), textureLoad(behind, at, 0)));
        at = next_covered(at + vec2u(0u, 1u), end);
        if (at.y >= end) {
            break;
        }
    }
}
