// The same by tiles.
//#include "hair_class.wgsl"
//#include "strand_team.wgsl"

var<private> sum: Dense;
var<private> surface: f32; // how deep it is

fn begin_pieces(pixel: vec2u) {
    surface = 0.0;
    if (all(pixel < vec2u(strand_view.size))) {
        surface = depths_at(pixel).first.x;
    }
}

fn see_piece(seen: Fragment) {
    sum = with_piece(sum, seen, surface);
}

@compute @workgroup_size(8, 8)
fn main(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) tile: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    sum = NO_HAIRS;
    see_pieces(id.xy, tile.xy, lane);
    let size = vec2u(strand_view.size);
    if (all(id.xy < size)) {
        hair_labels[id.y * size.x + id.x] = labels_of(sum);
    }
}
