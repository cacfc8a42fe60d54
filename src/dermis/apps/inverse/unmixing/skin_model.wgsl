// Colours of skins, and their melanin and blood by Gauss and Newton's steps; solve.py is the same in float64.

override NODES: u32; // along the roots of melanin and of blood
override THIRDS: u32; // of the third number, when the table has it
override SHADE: bool; // whether the third number is the logarithm of a factor

struct Model {
    span: vec2f, // of the third number
    usual: f32,
    spread: f32,
    noise: f32, // of a channel, relative
    floor: f32, // below which no colour is known
    darkest: f32,
    steps: u32,
    blood: vec2f, // what its root is believed to be, and how far from it
}

// Logarithms of a colour, and their slopes along the three unknowns.
struct Slopes {
    logs: vec3f,
    p: vec3f,
    q: vec3f,
    t: vec3f,
}

// What the differences of the logarithms say: curvature of half the cost, its slope downwards, the cost, and they.
struct System {
    pp: f32,
    pq: f32,
    qq: f32,
    pt: f32,
    qt: f32,
    tt: f32,
    down: vec3f,
    cost: f32,
    off: vec3f,
}

struct Found {
    x: vec3f,
    system: System,
}

const DONE: f32 = 1e-4; // a step that ends the search: the next one would be a hundredth of it
const CURVED: f32 = 1e-6; // added to curvatures, for nodes where a number does not show

@group(0) @binding(0) var<uniform> model: Model;
@group(0) @binding(1) var table: texture_2d_array<f32>; // logarithms, across blood, down melanin, layers by third

fn plane(third: u32, node: vec2u, share: vec2f) -> Slopes {
    let a = textureLoad(table, node.yx, third, 0).rgb;
    let b = textureLoad(table, node.yx + vec2u(1u, 0u), third, 0).rgb;
    let c = textureLoad(table, node.yx + vec2u(0u, 1u), third, 0).rgb;
    let d = textureLoad(table, node.yx + vec2u(1u, 1u), third, 0).rgb;
    let near = mix(a, b, share.y);
    let far = mix(c, d, share.y);
    let scale = f32(NODES - 1u);
    return Slopes(mix(near, far, share.x), scale * (far - near), scale * mix(b - a, d - c, share.x), vec3f(0.0));
}

fn slopes_at(x: vec3f) -> Slopes {
    let place = clamp(x.xy, vec2f(0.0), vec2f(1.0)) * f32(NODES - 1u);
    let node = min(vec2u(place), vec2u(NODES - 2u));
    let share = place - vec2f(node);
    if (THIRDS == 1u) {
        var found = plane(0u, node, share);
        if (SHADE) {
            found.logs += x.z;
            found.t = vec3f(1.0);
        }
        return found;
    }
    let scale = f32(THIRDS - 1u) / (model.span.y - model.span.x);
    let height = clamp((x.z - model.span.x) * scale, 0.0, f32(THIRDS - 1u));
    let under = min(u32(height), THIRDS - 2u);
    let w = height - f32(under);
    let low = plane(under, node, share);
    let high = plane(under + 1u, node, share);
    let t = scale * (high.logs - low.logs);
    return Slopes(mix(low.logs, high.logs, w), mix(low.p, high.p, w), mix(low.q, high.q, w), t);
}

// One over the variances of a colour's logarithms.
fn weights_of(colour: vec3f) -> vec3f {
    let unsure = model.floor / max(colour, vec3f(model.darkest));
    return 1.0 / (model.noise * model.noise + unsure * unsure);
}

fn system_at(x: vec3f, logs: vec3f, weights: vec3f) -> System {
    let there = slopes_at(x);
    let off = logs - there.logs;
    let bled = (x.y - model.blood.x) / model.blood.y;
    let w = weights;
    var found = System(
        dot(w, there.p * there.p) + CURVED,
        dot(w, there.p * there.q),
        dot(w, there.q * there.q) + 1.0 / (model.blood.y * model.blood.y),
        0.0,
        0.0,
        1.0,
        vec3f(dot(w, there.p * off), dot(w, there.q * off) - bled / model.blood.y, 0.0),
        dot(w, off * off) + bled * bled,
        off,
    );
    if (SHADE || THIRDS > 1u) {
        let belief = 1.0 / (model.spread * model.spread);
        let away = x.z - model.usual;
        found.pt = dot(w, there.p * there.t);
        found.qt = dot(w, there.q * there.t);
        found.tt = dot(w, there.t * there.t) + belief;
        found.down.z = dot(w, there.t * off) - belief * away;
        found.cost += belief * away * away;
    }
    return found;
}

// The third number follows from the others at each step, which leaves a system of two.
fn reduced(s: System) -> array<f32, 5> {
    let a = s.pt / s.tt;
    let b = s.qt / s.tt;
    return array<f32, 5>(s.pp - a * s.pt, s.pq - a * s.qt, s.qq - b * s.qt, s.down.x - a * s.down.z, s.down.y - b * s.down.z);
}

// A step of Gauss and Newton, damped by Levenberg's rule.
fn step_of(s: System, x: vec3f, damping: f32) -> vec3f {
    let r = reduced(s);
    let pp = r[0] * (1.0 + damping);
    let qq = r[2] * (1.0 + damping);
    var step = vec2f(qq * r[3] - r[1] * r[4], pp * r[4] - r[1] * r[3]) / max(pp * qq - r[1] * r[1], 1e-9 * pp * qq);
    // A number at its limit is held there, and the other goes on without it.
    let out = (x.xy + step < vec2f(0.0) & x.xy <= vec2f(0.0)) | (x.xy + step > vec2f(1.0) & x.xy >= vec2f(1.0));
    step = select(step, vec2f(0.0, r[4] / qq), out.x);
    step = select(step, vec2f(r[3] / pp, 0.0), out.y & !out.x);
    return vec3f(step, (s.down.z - s.pt * step.x - s.qt * step.y) / s.tt);
}

// The unknowns of a colour from a first guess.
fn solved(start: vec3f, logs: vec3f, weights: vec3f) -> Found {
    let low = vec3f(0.0, 0.0, model.span.x);
    let high = vec3f(1.0, 1.0, model.span.y);
    var best = start;
    var there = system_at(start, logs, weights);
    var damping = 1e-3;
    for (var i = 0u; i < model.steps; i++) {
        let x = clamp(best + step_of(there, best, damping), low, high);
        let s = system_at(x, logs, weights);
        let better = s.cost <= there.cost;
        let done = all(abs(x - best) < vec3f(DONE));
        damping *= select(16.0, 0.1, better);
        if (better) {
            best = x;
            there = s;
        }
        if (done) {
            break;
        }
    }
    return Found(best, there);
}
