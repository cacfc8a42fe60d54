// Initial guesses: at each grid node the skin with the nearest log(red) and log(blue / green).
//#include "skin_model.wgsl"
//#include "first_guess.wgsl"

const CANDIDATES: u32 = 64u; // number of candidates along the roots of melanin and of blood
const MAX_STEPS: u32 = 4u;

@group(0) @binding(2) var<storage, read_write> guesses: array<vec2f>;

// Improve a candidate by Newton steps while they reduce the difference.
fn refine(start: vec2f, goal: vec2f) -> vec2f {
    let margin = 0.5 / f32(CANDIDATES);
    var best = start;
    for (var i = 0u; i < MAX_STEPS; i++) {
        let current = evaluate(vec3f(best, model.prior_mean));
        let difference = goal - vec2f(current.logs.r, current.logs.b - current.logs.g);
        let p = vec2f(current.p.r, current.p.b - current.p.g);
        let q = vec2f(current.q.r, current.q.b - current.q.g);
        let det = p.x * q.y - p.y * q.x;
        let step = vec2f(difference.x * q.y - difference.y * q.x, p.x * difference.y - p.y * difference.x) / select(det, 1e-6, abs(det) < 1e-6);
        let next = clamp(best + step, vec2f(margin), vec2f(1.0 - margin));
        let skin = evaluate(vec3f(next, model.prior_mean)).logs;
        let remaining = goal - vec2f(skin.r, skin.b - skin.g);
        best = select(best, next, dot(remaining, remaining) < dot(difference, difference));
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
    var min_cost = 3.4e38;
    for (var i = 0u; i < CANDIDATES; i++) {
        for (var j = 0u; j < CANDIDATES; j++) {
            let p = (vec2f(f32(i), f32(j)) + 0.5) / f32(CANDIDATES); // inside the limits, at which unknowns would be fixed
            let skin = evaluate(vec3f(p, model.prior_mean)).logs;
            let difference = vec2f(red - skin.r, blue - skin.b + skin.g);
            let cost = dot(difference, difference);
            best = select(best, p, cost < min_cost);
            min_cost = min(min_cost, cost);
        }
    }
    guesses[id.y * SIDE + id.x] = refine(best, vec2f(red, blue));
}
