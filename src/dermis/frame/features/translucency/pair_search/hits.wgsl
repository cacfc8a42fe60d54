// Sources that form a pair with each receiver. The sources of each tile that is paired with the receiver's tile are stored as
// bits of a word.
//#include "bounds.wgsl"

@group(0) @binding(3) var<storage, read> receiver_points: array<Receiver>;
@group(0) @binding(4) var<storage, read> source_points: array<Source>;
@group(0) @binding(5) var<storage, read> receiver_ranges: array<vec4u>; // range in `partners` of each receiver's tile, and the first word of its hits
@group(0) @binding(6) var<storage, read> partners: array<u32>; // tiles
@group(0) @binding(7) var<storage, read> tiles: array<Bounds>;
@group(0) @binding(8) var<storage, read> source_ranges: array<vec2u>; // range of sources of each tile
@group(0) @binding(9) var<storage, read_write> hits: array<u32>;
@group(0) @binding(10) var<storage, read_write> counts: array<u32>; // pairs of each receiver

const PI: f32 = 3.14159265358979;

// Whether a pair may transmit a relevant fraction of light, by the widest Gaussian.
fn may_matter(geometry: PairGeometry, area: f32) -> bool {
    let fraction = pair_fraction(geometry.cosine - TURN_MARGIN, geometry.inward + TURN_MARGIN);
    let v = search.variance_mm2;
    return fraction * area * exp(-0.5 * geometry.distance2 / v) > MIN_FRACTION * 2.0 * PI * v;
}

@compute @workgroup_size(EACH)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let index = list_index(group, groups, lane);
    if (index >= search.count) {
        return;
    }
    let position = receiver_points[index].position;
    let normal = receiver_points[index].normal;
    let point = Bounds(position, 1.0, position, 0.0, normal, 1u);
    let range = receiver_ranges[index];
    var count = 0u;
    for (var k = range.x; k < range.y; k++) {
        let other = partners[k];
        let sources = source_ranges[other];
        let end = select(sources.x, sources.y, may_pair(point, tiles[other]));
        var bits = 0u;
        for (var j = sources.x; j < end; j++) {
            let source = source_points[j];
            let to = source.centre - position;
            // cheap tests first: most sources are out of reach
            if (dot(to, to) < search.radius_mm * search.radius_mm && dot(normal, source.normal) < MAX_COSINE + TURN_MARGIN) {
                let matters = may_matter(pair_geometry(position, normal, source), source.area);
                bits |= select(0u, 1u, matters) << (j - sources.x);
            }
        }
        hits[range.z + k - range.x] = bits;
        count += countOneBits(bits);
    }
    counts[index] = count;
}
