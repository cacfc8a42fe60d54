// Numbers of connected texels of the same chart to the left, right, up and down; the top bit of the first component marks gutter texels.

//#fill const GUTTER_BIT: u32 = {gutter_bit}u;

fn is_gutter(reach: vec4u) -> bool {
    return (reach.x & GUTTER_BIT) != 0u;
}

fn reach_along(reach: vec4u, axis: u32) -> vec2f {
    return vec2f(select(reach.zw, vec2u(reach.x & ~GUTTER_BIT, reach.y), axis == 0u));
}
