// Up to 64 samples of a pixel as bits.

// One of 64 bits.
fn bit_of(index: u32) -> vec2u {
    return select(vec2u(0u, 1u << (index % 32u)), vec2u(1u << (index % 32u), 0u), index < 32u);
}

// As many bits from the first on.
fn samples_of(count: u32) -> vec2u {
    return vec2u(extractBits(~0u, 0u, min(count, 32u)), extractBits(~0u, 0u, max(count, 32u) - 32u));
}
