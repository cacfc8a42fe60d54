// The same by tiles: the invocations of a workgroup each follow one of the tile's chains and share what they find.
//#include "strand_fragments.wgsl"

const LANES: u32 = 64u; // of a workgroup, which does a tile

@group(0) @binding(31) var<storage, read> chains: array<u32>; // see strands_bin.wgsl
@group(0) @binding(32) var<storage, read> links: array<vec2u>;
@group(0) @binding(34) var behind: texture_2d<f32>; // radiance and coverage
@group(0) @binding(35) var image: texture_storage_2d<rgba32float, write>;

var<workgroup> held: array<Held, LANES>;
var<workgroup> found: atomic<u32>;
var<workgroup> count: u32;

@compute @workgroup_size(8, 8)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let pixel = id.xy;
    let inside = all(pixel < textureDimensions(image));
    let under = textureLoad(behind, pixel, 0);
    var link = 0u;
    if (lane < WAYS) {
        link = chains[1u + (tile.y * tiles_across(strand_view.size) + tile.x) * WAYS + lane];
    }
    var depths = Depths(vec4f(-1.0), vec4f(-1.0), 1.0);
    var any = false;
    loop {
        if (lane == 0u) {
            atomicStore(&found, 0u);
        }
        workgroupBarrier();
        if (link != 0u) {
            let one = links[link - 1u];
            held[atomicAdd(&found, 1u)] = hold(one.x);
            link = one.y;
        }
        workgroupBarrier();
        if (lane == 0u) {
            count = atomicLoad(&found);
        }
        let many = workgroupUniformLoad(&count);
        if (many == 0u) {
            break;
        }
        if (!any) {
            take_none();
            if (inside) {
                depths = depths_at(pixel);
            }
        }
        any = true;
        for (var k = 0u; k < many; k += 1u) {
            var one = fragment_of(vec2f(pixel) + 0.5, held[k]);
            one.cover *= free_share(one.depth, depths);
            if (one.cover > 0.0) {
                take(one);
            }
        }
        workgroupBarrier();
    }
    if (!inside) {
        return;
    }
    if (any) {
        textureStore(image, pixel, laid_over(under));
    } else {
        textureStore(image, pixel, under);
    }
}
