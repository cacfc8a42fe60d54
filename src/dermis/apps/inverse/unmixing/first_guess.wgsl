// The grid of first guesses, over the logarithms of red and of blue over green: red and green alone would not tell
// much melanin from much blood.

override SIDE: u32;
const REDS: vec2f = vec2f(-4.6, 0.0);
const BLUES: vec2f = vec2f(-1.6, 0.6);

// Where a colour lies among the nodes.
fn place_among_guesses(logs: vec3f) -> vec2f {
    let share = (vec2f(logs.r, logs.b - logs.g) - vec2f(REDS.x, BLUES.x)) / vec2f(REDS.y - REDS.x, BLUES.y - BLUES.x);
    return clamp(share, vec2f(0.0), vec2f(1.0)) * f32(SIDE - 1u);
}
