// Sums over the zones of the face of changes of the skin, such as of its blood, at each texel of its maps.
//#include "surface/painting/spot.wgsl"

//#fill const BLOTCH_ROWS: vec2u = vec2u({first_blotch_row}u, {end_blotch_row}u);
const BLOTCHES: f32 = 0.35; // artistic value: relative variation of the changes by blotches
const LID_MM: vec2f = vec2f(0.5, 2.2); // distances from the edge of the lids between which their mask falls from 1 to 0

struct ZoneChanges {
    everywhere: vec4f, // changes of four quantities, see ZoneChanges in human/living/zones.py
    lips: vec4f,
    lid_edges: vec4f,
    blotches: f32, // 1 if the changes vary in blotches, else 0
    //#fill zones: array<vec4f, {zones}>,
}

@group(0) @binding(3) var<storage, read> owners: array<u32>;
@group(0) @binding(5) var<uniform> changes: ZoneChanges;
@group(0) @binding(6) var change_map: texture_storage_2d<rgba16float, write>;

fn zone_sum(spot: Spot) -> vec4f {
    let p = spot.left + WANDER_MM * vec3f(noise[NOISE_WANDER_X], noise[NOISE_WANDER_Y], 0.0);
    var sum = vec4f(0.0);
    for (var k = 0u; k < ZONES; k++) {
        let off = (p - tables.zones[k].centre.xyz) * tables.zones[k].inverse_radii.xyz;
        sum += exp(-dot(off, off)) * changes.zones[k];
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(paint.side))) {
        return;
    }
    let owner = owners[id.y * paint.side + id.x];
    if (owner == 0u) {
        textureStore(change_map, id.xy, changes.everywhere);
        return;
    }
    let spot = spot_of(owner, id.xy);
    for (var k = 0u; k < NOISES; k++) {
        noise[k] = 0.0;
    }
    make_noise(spot, 0u, WANDER_ROWS, 1u << GROUND_ALL);
    make_noise(spot, BLOTCH_ROWS.x, BLOTCH_ROWS.y, 1u << GROUND_ALL);
    let lips = smoothstep(LIP_MM.x, LIP_MM.y, spot.fields.x);
    let lid_edges = 1.0 - smoothstep(LID_MM.x, LID_MM.y, spot.fields.z);
    let sum = zone_sum(spot) + changes.everywhere + lips * changes.lips + lid_edges * changes.lid_edges;
    textureStore(change_map, id.xy, sum * (1.0 + changes.blotches * BLOTCHES * noise[NOISE_BLOTCHES]));
}
