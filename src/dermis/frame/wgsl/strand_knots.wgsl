// Hairs as rows: where each stands on the skin, what its inside absorbs, and its knots from root to tip.

override KNOTS: u32 = 2u; // of a hair

const KNOTS_FROM: u32 = 2u; // rows of a hair before its knots: the skin's normal, then the absorption [1/mm]

fn rows_of_strand() -> u32 {
    return KNOTS_FROM + KNOTS;
}
