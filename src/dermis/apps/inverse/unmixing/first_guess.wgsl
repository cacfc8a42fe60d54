// Grid of initial guesses over log(red) and log(blue / green), which distinguish melanin from blood better than
// red and green.

override SIDE: u32;
const REDS: vec2f = vec2f(-4.6, 0.0);
const BLUES: vec2f = vec2f(-1.6, 0.6);

// Return the grid position of a colour, given by its logarithms, in units of nodes.
fn guess_position(logs: vec3f) -> vec2f {
    let fraction = (vec2f(logs.r, logs.b - logs.g) - vec2f(REDS.x, BLUES.x)) / vec2f(REDS.y - REDS.x, BLUES.y - BLUES.x);
    return clamp(fraction, vec2f(0.0), vec2f(1.0)) * f32(SIDE - 1u);
}
