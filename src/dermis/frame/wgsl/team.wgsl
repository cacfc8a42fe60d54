// Sums over teams of invocations that are neighbours in a workgroup.
//#include "each.wgsl"

override TEAM: u32 = 1u; // invocations of a team: a power of two up to EACH

var<workgroup> part: array<vec4f, EACH>;

// The sum of a team's values, for its first member; all of a workgroup call it.
fn of_team(value: vec4f, lane: u32) -> vec4f {
    if (TEAM == 1u) {
        return value;
    }
    workgroupBarrier(); // others may still read what was summed before
    part[lane] = value;
    for (var apart = TEAM / 2u; apart > 0u; apart /= 2u) {
        workgroupBarrier();
        if (lane % TEAM < apart) {
            part[lane] += part[lane + apart];
        }
    }
    return part[lane];
}
