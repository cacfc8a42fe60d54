// Sums over groups of adjacent invocations of a workgroup.
//#include "each.wgsl"

override TEAM: u32 = 1u; // invocations per group: a power of two up to EACH

var<workgroup> part: array<vec4f, EACH>;

// Sum over a group, valid in its first invocation; all invocations of the workgroup must call it.
fn team_sum(value: vec4f, lane: u32) -> vec4f {
    if (TEAM == 1u) {
        return value;
    }
    workgroupBarrier(); // others may still read the previous sum
    part[lane] = value;
    for (var stride = TEAM / 2u; stride > 0u; stride /= 2u) {
        workgroupBarrier();
        if (lane % TEAM < stride) {
            part[lane] += part[lane + stride];
        }
    }
    return part[lane];
}
