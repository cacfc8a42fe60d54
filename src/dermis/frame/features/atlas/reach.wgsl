// Texels on the same chart without a gap: left, right, up, down; the first number's top bit marks texels of gutters.

//#fill const GUTTER_BIT: u32 = {gutter_bit}u;

fn is_gutter(reach: vec4u) -> bool {
    return (reach.x & GUTTER_BIT) != 0u;
}

fn reach_along(reach: vec4u, axis: u32) -> vec2f {
    return vec2f(select(reach.zw, vec2u(reach.x & ~GUTTER_BIT, reach.y), axis == 0u));
}
