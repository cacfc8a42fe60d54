// Which sources lie across the flesh from each receiver: a word of bits for each tile that its own one faces.
//#include "bounds.wgsl"

@group(0) @binding(3) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(4) var<storage, read> source_points: array<Source>;
@group(0) @binding(5) var<storage, read> looks: array<vec4u>; // of receivers: tiles that are faced, first and end; first word
@group(0) @binding(6) var<storage, read> facing: array<u32>; // tiles
@group(0) @binding(7) var<storage, read> tiles: array<Bounds>;
@group(0) @binding(8) var<storage, read> sources_of: array<vec2u>; // first and end of each tile's
@group(0) @binding(9) var<storage, read_write> hits: array<u32>;
@group(0) @binding(10) var<storage, read_write> counts: array<u32>; // of each receiver

const PI: f32 = 3.14159265358979;

// Whether a pair within reach lets light pass that counts, by the widest Gaussian.
fn counts_ever(lie: Lie, area: f32) -> bool {
    let share = share_of(lie.cosine - TURN, lie.inward + TURN);
    let v = search.variance_mm2;
    return share * area * exp(-0.5 * lie.square / v) > LEAST * 2.0 * PI * v;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = number_of(group, groups, lane);
    if (index >= search.count) {
        return;
    }
    let place = receiver_points[index].position;
    let normal = receiver_points[index].normal;
    let point = Bounds(place, 1.0, place, 0.0, normal, 1u);
    let look = looks[index];
    var count = 0u;
    for (var k = look.x; k < look.y; k++) {
        let other = facing[k];
        let listed = sources_of[other];
        let end = select(listed.x, listed.y, may_pair(point, tiles[other]));
        var bits = 0u;
        for (var j = listed.x; j < end; j++) {
            let source = source_points[j];
            let to = source.centre - place;
            // the rest takes longer, and most are out of reach
            if (dot(to, to) < search.radius_mm * search.radius_mm && dot(normal, source.normal) < ASKEW + TURN) {
                let counted = counts_ever(lie_of(place, normal, source), source.area);
                bits |= select(0u, 1u, counted) << (j - listed.x);
            }
        }
        hits[look.z + k - look.x] = bits;
        count += countOneBits(bits);
    }
    counts[index] = count;
}
