// The same by tiles.
//#include "strand_team.wgsl"
//#include "strand_labels.wgsl"

@group(0) @binding(34) var behind: texture_2d<f32>; // radiance and coverage
@group(0) @binding(35) var image: texture_storage_2d<rgba32float, write>;

var<private> depths: Depths;

fn begin_pieces(pixel: vec2u) {
    take_none();
    depths = Depths(vec4f(-1.0), vec4f(-1.0), 1.0);
    if (all(pixel < textureDimensions(image))) {
        depths = depths_at(pixel);
        begin_labels(pixel);
    }
}

fn see_piece(seen: Fragment) {
    label_piece(seen);
    var one = seen;
    one.cover *= free_share(one.depth, depths);
    if (one.cover > 0.0) {
        take(one);
    }
}

// What a layer knows of a pixel, on its way to the first layer.
struct Rest {
    farther: array<u32, 2>,
    light: array<u32, 3>,
}

var<workgroup> handed: array<array<Fragment, NEAREST>, LANES>;
var<workgroup> rests: array<Rest, LANES>;

fn hand_over(lane: u32) {
    handed[lane] = kept;
    rests[lane] = Rest(array<u32, 2>(farther.x, farther.y), array<u32, 3>(light.x, light.y, light.z));
    hand_labels_over(lane);
}

fn take_over(lane: u32) {
    for (var k = 0u; k < NEAREST; k += 1u) {
        let one = handed[lane][k];
        if (one.cover > 0.0) {
            take(one);
        }
    }
    let rest = rests[lane];
    farther += vec2u(rest.farther[0], rest.farther[1]);
    light += vec3u(rest.light[0], rest.light[1], rest.light[2]);
    take_labels_over(lane);
}

@compute @workgroup_size(STRAND_TILE, STRAND_TILE, LAYERS)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) index: u32,
) {
    let layer = index / LANES;
    let lane = index % LANES;
    let covered = see_pieces(id.xy, tile.xy, lane, layer);
    for (var other = 1u; covered && other < LAYERS; other += 1u) {
        workgroupBarrier();
        if (layer == other) {
            hand_over(lane);
        }
        workgroupBarrier();
        if (layer == 0u) {
            take_over(lane);
        }
    }
    if (layer > 0u || any(id.xy >= textureDimensions(image))) {
        return;
    }
    put_label(id.xy);
    let under = textureLoad(behind, id.xy, 0);
    if (covered) {
        textureStore(image, id.xy, laid_over(under));
    } else {
        textureStore(image, id.xy, under);
    }
}
