// Distances from points of an eye to the edges of the eyelids, which are stored in `shade.lids`.
//#include "eye.wgsl"

const LID_POINTS: u32 = 56u; // points of the edges around an eye
const LOWER_LID: vec2u = vec2u(27u, 49u); // first and last point of the lower lid
const FARTHEST_LID: f32 = 1e6;

// Distances of the edges of the lids from a point of an eye, both projected onto the ball from its centre. Edges of zeros are
// unknown and count as far away.
fn lids_around(eye: u32, p: vec3f) -> Lids {
    let q = SCLERA_MM * normalize(p);
    var lids = Lids(FARTHEST_LID, FARTHEST_LID, vec3f(0.0));
    var a = SCLERA_MM * normalize(shade.lids[eye * LID_POINTS + LID_POINTS - 1u].xyz);
    let known = select(0u, LID_POINTS, shade.lids[eye * LID_POINTS].w > 0.0);
    var i = 0u;
    loop {
        if (i >= known) {
            break;
        }
        let b = SCLERA_MM * normalize(shade.lids[eye * LID_POINTS + i].xyz);
        let t = clamp(dot(q - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
        let off = q - mix(a, b, t);
        let far = length(off);
        if (i < LOWER_LID.x || i > LOWER_LID.y) {
            lids.above = min(lids.above, far);
        } else if (far < lids.below) {
            lids.below = far;
            lids.from_below = off / max(far, 1e-4);
        }
        a = b;
        i++;
    }
    return lids;
}
