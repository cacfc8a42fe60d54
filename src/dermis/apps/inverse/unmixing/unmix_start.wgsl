// Where the search for each colour starts: the nearest skins by red, and by blue over green.
//#include "skin_model.wgsl"
//#include "first_guess.wgsl"

const CANDIDATES: u32 = 64u; // along the roots of melanin and of blood
const REFINED: u32 = 4u;

@group(0) @binding(2) var<storage, read_write> starts: array<vec2f>;

// Newton's steps from the nearest candidate, as long as they come nearer.
fn refined(start: vec2f, wanted: vec2f) -> vec2f {
    let least = 0.5 / f32(CANDIDATES);
    var best = start;
    for (var i = 0u; i < REFINED; i++) {
        let there = slopes_at(vec3f(best, model.usual));
        let off = wanted - vec2f(there.logs.r, there.logs.b - there.logs.g);
        let p = vec2f(there.p.r, there.p.b - there.p.g);
        let q = vec2f(there.q.r, there.q.b - there.q.g);
        let det = p.x * q.y - p.y * q.x;
        let step = vec2f(off.x * q.y - off.y * q.x, p.x * off.y - p.y * off.x) / select(det, 1e-6, abs(det) < 1e-6);
        let next = clamp(best + step, vec2f(least), vec2f(1.0 - least));
        let skin = slopes_at(vec3f(next, model.usual)).logs;
        let left = wanted - vec2f(skin.r, skin.b - skin.g);
        best = select(best, next, dot(left, left) < dot(off, off));
    }
    return best;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy >= vec2u(SIDE))) {
        return;
    }
    let red = mix(REDS.x, REDS.y, f32(id.x) / f32(SIDE - 1u));
    let blue = mix(BLUES.x, BLUES.y, f32(id.y) / f32(SIDE - 1u));
    var best = vec2f(0.0);
    var least = 3.4e38;
    for (var i = 0u; i < CANDIDATES; i++) {
        for (var j = 0u; j < CANDIDATES; j++) {
            let p = (vec2f(f32(i), f32(j)) + 0.5) / f32(CANDIDATES); // none at a limit, where numbers are held
            let skin = slopes_at(vec3f(p, model.usual)).logs;
            let off = vec2f(red - skin.r, blue - skin.b + skin.g);
            let cost = dot(off, off);
            best = select(best, p, cost < least);
            least = min(least, cost);
        }
    }
    starts[id.y * SIDE + id.x] = refined(best, vec2f(red, blue));
}
