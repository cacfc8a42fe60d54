// Skin model and its inversion by damped Gauss-Newton steps, as in skin_model.py, which computes in float64.

override NODES: u32; // number of table nodes along the square roots of melanin and of blood
override EXTRA_NODES: u32; // nodes of the extra unknown, 1 if it is not in the table
override SHADE: bool; // whether the extra unknown is the logarithm of a factor

struct Model {
    extra_range: vec2f, // limits of the extra unknown
    prior_mean: f32, // of the extra unknown
    prior_sd: f32,
    blood_mean: f32, // prior of the root of the blood fraction
    blood_sd: f32,
    noise: f32, // relative standard deviation of a channel
    floor: f32, // absolute standard deviation of a colour
    min_reflectance: f32,
    steps: u32,
}

// Logarithms of a colour, and their derivatives by the three unknowns.
struct Evaluation {
    logs: vec3f,
    p: vec3f,
    q: vec3f,
    t: vec3f,
}

// Curvature of half the cost, its negative gradient, the cost, and the differences of the logarithms.
struct NormalEquations {
    pp: f32,
    pq: f32,
    qq: f32,
    pt: f32,
    qt: f32,
    tt: f32,
    descent: vec3f,
    cost: f32,
    difference: vec3f,
}

struct Solution {
    x: vec3f,
    system: NormalEquations,
}

const TOLERANCE: f32 = 1e-4; // largest step at which the search ends
const MIN_CURVATURE: f32 = 1e-6; // added to curvatures, for nodes where an unknown has no effect

@group(0) @binding(0) var<uniform> model: Model;
@group(0) @binding(1) var table: texture_2d_array<f32>; // logarithms by blood (x), melanin (y) and extra unknown (layer)

fn evaluate_layer(layer: u32, node: vec2u, fraction: vec2f) -> Evaluation {
    let a = textureLoad(table, node.yx, layer, 0).rgb;
    let b = textureLoad(table, node.yx + vec2u(1u, 0u), layer, 0).rgb;
    let c = textureLoad(table, node.yx + vec2u(0u, 1u), layer, 0).rgb;
    let d = textureLoad(table, node.yx + vec2u(1u, 1u), layer, 0).rgb;
    let near = mix(a, b, fraction.y);
    let far = mix(c, d, fraction.y);
    let scale = f32(NODES - 1u);
    return Evaluation(mix(near, far, fraction.x), scale * (far - near), scale * mix(b - a, d - c, fraction.x), vec3f(0.0));
}

fn evaluate(x: vec3f) -> Evaluation {
    let position = clamp(x.xy, vec2f(0.0), vec2f(1.0)) * f32(NODES - 1u);
    let node = min(vec2u(position), vec2u(NODES - 2u));
    let fraction = position - vec2f(node);
    if (EXTRA_NODES == 1u) {
        var result = evaluate_layer(0u, node, fraction);
        if (SHADE) {
            result.logs += x.z;
            result.t = vec3f(1.0);
        }
        return result;
    }
    let scale = f32(EXTRA_NODES - 1u) / (model.extra_range.y - model.extra_range.x);
    let height = clamp((x.z - model.extra_range.x) * scale, 0.0, f32(EXTRA_NODES - 1u));
    let lower = min(u32(height), EXTRA_NODES - 2u);
    let w = height - f32(lower);
    let low = evaluate_layer(lower, node, fraction);
    let high = evaluate_layer(lower + 1u, node, fraction);
    let t = scale * (high.logs - low.logs);
    return Evaluation(mix(low.logs, high.logs, w), mix(low.p, high.p, w), mix(low.q, high.q, w), t);
}

// Return the inverse variances of a colour's logarithms.
fn inverse_variances(colour: vec3f) -> vec3f {
    let absolute = model.floor / max(colour, vec3f(model.min_reflectance));
    return 1.0 / (model.noise * model.noise + absolute * absolute);
}

fn normal_equations(x: vec3f, logs: vec3f, weights: vec3f) -> NormalEquations {
    let current = evaluate(x);
    let difference = logs - current.logs;
    let blood_offset = (x.y - model.blood_mean) / model.blood_sd;
    let w = weights;
    var result = NormalEquations(
        dot(w, current.p * current.p) + MIN_CURVATURE,
        dot(w, current.p * current.q),
        dot(w, current.q * current.q) + 1.0 / (model.blood_sd * model.blood_sd),
        0.0,
        0.0,
        1.0,
        vec3f(dot(w, current.p * difference), dot(w, current.q * difference) - blood_offset / model.blood_sd, 0.0),
        dot(w, difference * difference) + blood_offset * blood_offset,
        difference,
    );
    if (SHADE || EXTRA_NODES > 1u) {
        let prior_weight = 1.0 / (model.prior_sd * model.prior_sd);
        let offset = x.z - model.prior_mean;
        result.pt = dot(w, current.p * current.t);
        result.qt = dot(w, current.q * current.t);
        result.tt = dot(w, current.t * current.t) + prior_weight;
        result.descent.z = dot(w, current.t * difference) - prior_weight * offset;
        result.cost += prior_weight * offset * offset;
    }
    return result;
}

// Eliminate the extra unknown, which leaves a system of two.
fn eliminate_extra(s: NormalEquations) -> array<f32, 5> {
    let a = s.pt / s.tt;
    let b = s.qt / s.tt;
    return array<f32, 5>(s.pp - a * s.pt, s.pq - a * s.qt, s.qq - b * s.qt, s.descent.x - a * s.descent.z, s.descent.y - b * s.descent.z);
}

// Return a Gauss-Newton step with Levenberg damping. An extra unknown at its limit is fixed.
fn damped_step(s: NormalEquations, x: vec3f, damping: f32) -> vec3f {
    let step = pair_step(eliminate_extra(s), x, damping);
    let extra = (s.descent.z - s.pt * step.x - s.qt * step.y) / s.tt;
    let range = model.extra_range;
    if ((x.z <= range.x && extra < 0.0) || (x.z >= range.y && extra > 0.0)) {
        return vec3f(pair_step(array<f32, 5>(s.pp, s.pq, s.qq, s.descent.x, s.descent.y), x, damping), 0.0);
    }
    return vec3f(step, extra);
}

// Return the damped step of melanin and blood from a system of two.
fn pair_step(r: array<f32, 5>, x: vec3f, damping: f32) -> vec2f {
    let pp = r[0] * (1.0 + damping);
    let qq = r[2] * (1.0 + damping);
    var step = vec2f(qq * r[3] - r[1] * r[4], pp * r[4] - r[1] * r[3]) / max(pp * qq - r[1] * r[1], 1e-9 * pp * qq);
    // An unknown at its limit is fixed, and the other one is solved for without it.
    let at_limit = (x.xy + step < vec2f(0.0) & x.xy <= vec2f(0.0)) | (x.xy + step > vec2f(1.0) & x.xy >= vec2f(1.0));
    step = select(step, vec2f(0.0, r[4] / qq), at_limit.x);
    return select(step, vec2f(r[3] / pp, 0.0), at_limit.y & !at_limit.x);
}

// Solve for the unknowns of a colour from an initial guess.
fn solve(start: vec3f, logs: vec3f, weights: vec3f) -> Solution {
    let low = vec3f(0.0, 0.0, model.extra_range.x);
    let high = vec3f(1.0, 1.0, model.extra_range.y);
    var best = start;
    var current = normal_equations(start, logs, weights);
    var damping = 1e-3;
    for (var i = 0u; i < model.steps; i++) {
        let x = clamp(best + damped_step(current, best, damping), low, high);
        let s = normal_equations(x, logs, weights);
        let better = s.cost <= current.cost;
        let converged = all(abs(x - best) < vec3f(TOLERANCE));
        damping *= select(16.0, 0.1, better);
        if (better) {
            best = x;
            current = s;
        }
        if (converged) {
            break;
        }
    }
    return Solution(best, current);
}
