// Light along links: what some place gets from the patches that it sees; a team of invocations for each place.
//#include "team.wgsl"

@group(0) @binding(1) var<storage, read> first: array<u32>; // where the links of each place begin
@group(0) @binding(2) var<storage, read> links: array<vec2u>; // patch, form factor
@group(0) @binding(3) var<storage, read> sent: array<vec4f>; // light that leaves patches, and the share of light from everywhere that enters

// Light, and the share of the hemisphere that it comes from; whole in the team's first member.
// here : whether there is such a place
fn gathered(index: u32, here: bool, lane: u32) -> vec4f {
    var sum = vec4f(0.0);
    if (here) {
        let end = min(first[index + 1u], arrayLength(&links));
        for (var k = first[index] + lane % TEAM; k < end; k += TEAM) {
            let link = links[k];
            sum += bitcast<f32>(link.y) * vec4f(sent[link.x].rgb, 1.0);
        }
    }
    return of_team(sum, lane);
}
