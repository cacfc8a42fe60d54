// The grid of first guesses, over the logarithms of red and of blue over green: red and green alone would not tell
// much melanin from much blood.

override SIDE: u32;
const REDS: vec2f = vec2f(-4.6, 0.0);
const BLUES: vec2f = vec2f(-1.6, 0.6);

fn guess_for(logs: vec3f) -> u32 {
    let share = (vec2f(logs.r, logs.b - logs.g) - vec2f(REDS.x, BLUES.x)) / vec2f(REDS.y - REDS.x, BLUES.y - BLUES.x);
    let node = vec2u(clamp(share, vec2f(0.0), vec2f(1.0)) * f32(SIDE - 1u) + 0.5);
    return node.y * SIDE + node.x;
}
