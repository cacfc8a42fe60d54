// Floats rounded to the nearest half floats. Some adapters truncate when they store half floats, so that each pass would lose
// energy.

const LARGEST_HALF: f32 = 65504.0;

fn rounded_to_halves(v: vec4f) -> vec4f {
    let bits = bitcast<vec4u>(min(v, vec4f(LARGEST_HALF)));
    let odd = (bits >> vec4u(13u)) & vec4u(1u); // ties go to even ones
    return bitcast<vec4f>((bits + 0xfffu + odd) & vec4u(0xffffe000u));
}
