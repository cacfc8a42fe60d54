// Sets of up to 64 samples, stored as bits.

// One bit of 64.
fn bit_of(index: u32) -> vec2u {
    return select(vec2u(0u, 1u << (index % 32u)), vec2u(1u << (index % 32u), 0u), index < 32u);
}

// The first `count` bits of 64.
fn samples_of(count: u32) -> vec2u {
    return vec2u(extractBits(~0u, 0u, min(count, 32u)), extractBits(~0u, 0u, max(count, 32u) - 32u));
}
