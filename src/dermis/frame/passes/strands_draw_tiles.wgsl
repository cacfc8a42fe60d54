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

@compute @workgroup_size(8, 8)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let covered = see_pieces(id.xy, tile.xy, lane);
    if (any(id.xy >= textureDimensions(image))) {
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
