// Rasterises triangles in a compute pass: the nearest depth of each sample, and its triangle. A workgroup processes some
// triangles of one view, and one invocation sets up each triangle. The invocation draws a small triangle immediately; for a
// large triangle, it lists the blocks of pixels that may be covered, which teams of invocations then draw.
//#include "projected_triangle.wgsl"
//#include "record_visibility.wgsl"
//#include "tiles.wgsl"

override TRIANGLES: u32 = 32u; // triangles of a workgroup, at most as many as its invocations
override RUN: u32 = 1u; // consecutive triangles of the mesh in a workgroup
override SMALL: u32 = 16u; // largest number of pixels of a triangle that one invocation draws
override MAX_BLOCKS: u32 = 16u; // largest number of blocks of a triangle that one invocation lists; at most 32
override MAX_LISTED: u32 = 8u * TRIANGLES; // capacity of the list of a workgroup

override THREADS: u32 = 128u;
override TEAMS: u32 = THREADS / TEAM;

const TEAM: u32 = 16u; // invocations that draw a block

@group(0) @binding(34) var<storage, read_write> tiles: array<atomic<u32>>;

var<workgroup> triangles: array<ProjectedTriangle, TRIANGLES>;
var<workgroup> blocks: array<u32, MAX_LISTED>; // index in `triangles`, then x and y from the first block of the box
var<workgroup> block_count: atomic<u32>;
var<workgroup> large_triangles: array<u32, TRIANGLES>; // indices in `triangles` of triangles with more blocks
var<workgroup> large_count: atomic<u32>;

@compute @workgroup_size(THREADS)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    let first = group.y * groups.x + group.x;
    let step = groups.x * groups.y;
    let index = triangle_of(number, first, step);
    if (number == 0u) { // some software adapters keep the counts of the last workgroup
        atomicStore(&block_count, 0u);
        atomicStore(&large_count, 0u);
    }
    workgroupBarrier();
    if (number < TRIANGLES && index < views.triangles) {
        setup(index, number, group.z);
    }
    workgroupBarrier();
    let lane = number % TEAM;
    let count = min(atomicLoad(&block_count), MAX_LISTED);
    for (var k = number / TEAM; k < count; k += TEAMS) {
        let block = blocks[k];
        let slot = block & 0xffu;
        let at = first_block(triangles[slot].box) + vec2u((block >> 8u) & 0xffu, block >> 16u);
        draw_block(triangle_of(slot, first, step), triangles[slot], at, lane, group.z);
    }
    let larger = atomicLoad(&large_count);
    for (var k = 0u; k < larger; k++) {
        let slot = large_triangles[k];
        draw_large(triangle_of(slot, first, step), triangles[slot], (number / TEAM + k) % TEAMS, lane, group.z);
    }
}

// The runs of a workgroup are far apart in the mesh, because neighbours are often all large.
fn triangle_of(slot: u32, first: u32, step: u32) -> u32 {
    return (slot / RUN * step + first) * RUN + slot % RUN;
}

fn setup(index: u32, slot: u32, view: u32) {
    let triangle = setup_triangle(index, view);
    let pixels = triangle.box.size.x * triangle.box.size.y;
    if (pixels > 0u && pixels <= SMALL) {
        draw_small(index, triangle, view);
        mark_box(triangle.box, view);
    }
    if (pixels > SMALL) {
        triangles[slot] = triangle;
        list_blocks(triangle, slot, view);
    }
}

// Lists the blocks that the triangle may cover. If the list is full it counts as large: drawing a block twice does no harm.
fn list_blocks(triangle: ProjectedTriangle, slot: u32, view: u32) {
    let first = first_block(triangle.box);
    let size = block_counts(triangle.box);
    if (size.x * size.y > MAX_BLOCKS) {
        large_triangles[atomicAdd(&large_count, 1u)] = slot;
        return;
    }
    let margin = block_margin(triangle);
    var covered = 0u;
    for (var k = vec2u(0u); k.y < size.y; k = wrap(k + vec2u(1u, 0u), size.x)) {
        covered |= select(0u, 1u << (k.y * size.x + k.x), may_cover(triangle, margin, first + k));
    }
    mark_box(triangle.box, view); // once, as many blocks lie in one tile
    let count = countOneBits(covered);
    var at = atomicAdd(&block_count, count);
    if (at + count > MAX_LISTED) {
        large_triangles[atomicAdd(&large_count, 1u)] = slot;
    }
    for (var k = vec2u(0u); k.y < size.y && at < MAX_LISTED; k = wrap(k + vec2u(1u, 0u), size.x)) {
        if ((covered & (1u << (k.y * size.x + k.x))) != 0u) {
            blocks[at] = slot | (k.x << 8u) | (k.y << 16u);
            at++;
        }
    }
}

// Wraps x beyond the end of a row to the next rows.
fn wrap(k: vec2u, width: u32) -> vec2u {
    var at = k;
    while (at.x >= width) {
        at = vec2u(at.x - width, at.y + 1u);
    }
    return at;
}

// team: index of the team, which starts with another block for each triangle
fn draw_large(index: u32, triangle: ProjectedTriangle, team: u32, lane: u32, view: u32) {
    let margin = block_margin(triangle);
    let first = first_block(triangle.box);
    let size = block_counts(triangle.box);
    for (var k = wrap(vec2u(team, 0u), size.x); k.y < size.y; k = wrap(k + vec2u(TEAMS, 0u), size.x)) {
        if (may_cover(triangle, margin, first + k)) {
            for (var s = lane; s < SAMPLES; s += TEAM) {
                mark((first + k) * BLOCK / TILE, view * SAMPLES + s);
            }
            draw_block(index, triangle, first + k, lane, view);
        }
    }
}

// Part of a block that an invocation draws: a pixel, or four pixels of a column if each has a single sample.
fn draw_block(index: u32, triangle: ProjectedTriangle, block: vec2u, lane: u32, view: u32) {
    let pixel = block * BLOCK + vec2u(lane % BLOCK, lane / BLOCK);
    let at = pixel - triangle.box.low; // wraps around to a large number left of and above the box
    if (SAMPLES > 1u) {
        draw_samples(index, triangle, at, all(at < triangle.box.size), view);
        return;
    }
    let rows = vec4u(0u, 1u, 2u, 3u) * (TEAM / BLOCK);
    let inside = vec4<bool>(at.x < triangle.box.size.x) & (vec4u(at.y) + rows < vec4u(triangle.box.size.y));
    let position = vec2f(vec2i(at)) + views.sample[0].xy;
    let texels = vec4u(texel_of(pixel, view)) + rows * views.width;
    draw_four(index, triangle, vec4f(position.x), position.y + vec4f(rows), inside, texels);
}

fn draw_small(index: u32, triangle: ProjectedTriangle, view: u32) {
    let low = triangle.box.low;
    let size = triangle.box.size;
    for (var y = 0u; y < size.y; y++) {
        if (SAMPLES > 1u) {
            for (var x = 0u; x < size.x; x++) {
                draw_samples(index, triangle, vec2u(x, y), true, view);
            }
        } else {
            for (var x = 0u; x < size.x; x += 4u) {
                let four = x + vec4u(0u, 1u, 2u, 3u);
                let texels = texel_of(low + vec2u(0u, y), view) + four;
                let position = views.sample[0].xy;
                draw_four(index, triangle, position.x + vec4f(four), vec4f(position.y + f32(y)), four < vec4u(size.x), texels);
            }
        }
    }
}

// at: pixel relative to the box
fn draw_samples(index: u32, triangle: ProjectedTriangle, at: vec2u, inside: bool, view: u32) {
    let texel = texel_of(triangle.box.low + at, view * SAMPLES);
    let position = vec2f(vec2i(at));
    for (var s = 0u; s < SAMPLES; s += 4u) {
        let four = s + vec4u(0u, 1u, 2u, 3u);
        let x = vec4f(views.sample[s].x, views.sample[s + 1u].x, views.sample[s + 2u].x, views.sample[s + 3u].x);
        let y = vec4f(views.sample[s].y, views.sample[s + 1u].y, views.sample[s + 2u].y, views.sample[s + 3u].y);
        let tested = vec4<bool>(inside) & (four < vec4u(SAMPLES));
        draw_four(index, triangle, position.x + x, position.y + y, tested, texel + four * (views.width * views.height));
    }
}

// Tests four positions relative to the box, and records those inside the triangle.
fn draw_four(index: u32, triangle: ProjectedTriangle, x: vec4f, y: vec4f, tested: vec4<bool>, texels: vec4u) {
    let a = triangle.at_low.x + x * triangle.along_x.x + y * triangle.along_y.x;
    let b = triangle.at_low.y + x * triangle.along_x.y + y * triangle.along_y.y;
    let c = triangle.at_low.z + x * triangle.along_x.z + y * triangle.along_y.z;
    let depth = triangle.at_low.w + x * triangle.along_x.w + y * triangle.along_y.w;
    var covered = (min(min(a, b), c) >= vec4f(-SLACK)) & (depth > vec4f(0.0)) & (depth <= vec4f(1.0)) & tested;
    //#if CUTOUTS
    covered &= outside_holes(index, a * triangle.weight_scale.x, b * triangle.weight_scale.y, c * triangle.weight_scale.z);
    //#end
    record_four(index, depth, covered, texels);
}

//#if CUTOUTS
// Whether four positions with weights a, b, c of the corners are not in holes.
fn outside_holes(index: u32, a: vec4f, b: vec4f, c: vec4f) -> vec4<bool> {
    let t = triangle_at(index);
    if ((t.w & CUT_OUT) == 0u) {
        return vec4<bool>(true);
    }
    let sum = a + b + c;
    let p = corner_at(t.x).uv;
    let q = corner_at(t.y).uv;
    let r = corner_at(t.z).uv;
    let u = (a * p.x + b * q.x + c * r.x) / sum;
    let v = (a * p.y + b * q.y + c * r.y) / sum;
    return vec4<bool>(
        is_solid(vec2f(u.x, v.x)),
        is_solid(vec2f(u.y, v.y)),
        is_solid(vec2f(u.z, v.z)),
        is_solid(vec2f(u.w, v.w)),
    );
}
//#end

fn texel_of(pixel: vec2u, layer: u32) -> u32 {
    return (layer * views.height + pixel.y) * views.width + pixel.x;
}

fn mark_box(box: Box, view: u32) {
    let first = box.low / TILE;
    let last = (box.low + box.size - 1u) / TILE;
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            for (var s = 0u; s < SAMPLES; s++) {
                mark(vec2u(x, y), view * SAMPLES + s);
            }
        }
    }
}

// Marks a tile in which something may be drawn.
fn mark(tile: vec2u, layer: u32) {
    if (RECORDED != AS_TRIANGLE) {
        atomicStore(&tiles[tile_at(tile, layer)], DRAWN);
    }
}
