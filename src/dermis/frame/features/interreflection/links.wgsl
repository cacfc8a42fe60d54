// Sum of the light of all patches that a patch or cell sees, by a team of invocations.
//#include "team.wgsl"

@group(0) @binding(1) var<storage, read> first: array<u32>; // first link of each patch or cell
@group(0) @binding(2) var<storage, read> links: array<vec2u>; // patch, form factor
@group(0) @binding(3) var<storage, read> exitance: array<vec4f>; // exitance of the patches, and the fraction of uniform light that enters their skin

// Incident light, and the fraction of the hemisphere that it comes from; only the first member of a team gets the sum.
// exists : whether there is a patch or cell of this index
fn gathered(index: u32, exists: bool, lane: u32) -> vec4f {
    var sum = vec4f(0.0);
    if (exists) {
        let end = min(first[index + 1u], arrayLength(&links));
        for (var k = first[index] + lane % TEAM; k < end; k += TEAM) {
            let link = links[k];
            sum += bitcast<f32>(link.y) * vec4f(exitance[link.x].rgb, 1.0);
        }
    }
    return team_sum(sum, lane);
}
