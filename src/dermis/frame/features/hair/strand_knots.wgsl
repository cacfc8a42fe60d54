// Hairs as rows: where each stands on the skin, what its inside absorbs, and its knots from root to tip. Fine hairs come first,
// brows and lashes; then the coarse ones of head and beard, of which the first few stand for all where that is enough.

const ROWS_BEFORE: u32 = 2u; // of a hair before its knots: the skin's normal, then the absorption [1/mm] and how deep hair is

struct Hairs {
    fine: u32, // how many
    coarse: u32,
    shading: u32, // coarse ones that shade
    fine_knots: u32, // of each
    coarse_knots: u32,
    wider: f32, // than they are, for those that shade to do so as all do
}

@group(0) @binding(41) var<uniform> hairs: Hairs;

// Hair that a knot, or a piece between two knots, belongs to.
fn hair_of(index: u32, of_fine: u32, of_coarse: u32) -> u32 {
    let fines = hairs.fine * of_fine;
    if (index < fines) {
        return index / of_fine;
    }
    return hairs.fine + (index - fines) / of_coarse;
}

fn hair_of_knot(knot: u32) -> u32 {
    return hair_of(knot, hairs.fine_knots, hairs.coarse_knots);
}

fn hair_of_piece(piece: u32) -> u32 {
    return hair_of(piece, hairs.fine_knots - 1u, hairs.coarse_knots - 1u);
}

fn is_coarse(hair: u32) -> bool {
    return hair >= hairs.fine;
}

fn knots_of(hair: u32) -> u32 {
    return select(hairs.fine_knots, hairs.coarse_knots, is_coarse(hair));
}

fn first_knot(hair: u32) -> u32 {
    let of_coarse = hairs.fine * hairs.fine_knots + (hair - hairs.fine) * hairs.coarse_knots;
    return select(hair * hairs.fine_knots, of_coarse, is_coarse(hair));
}

// Of all fine hairs and some of the coarse ones.
fn pieces_of(coarse: u32) -> u32 {
    return hairs.fine * (hairs.fine_knots - 1u) + coarse * (hairs.coarse_knots - 1u);
}

fn all_knots(coarse: u32) -> u32 {
    return hairs.fine * hairs.fine_knots + coarse * hairs.coarse_knots;
}

// A piece as tiles list it: the knot at which it begins, and whether it is a hair's first and last.
const FIRST_PIECE: u32 = 0x40000000u;
const LAST_PIECE: u32 = 0x80000000u;

fn listed_piece(begin: u32, hair: u32) -> u32 {
    let k = begin - first_knot(hair);
    return begin | select(0u, FIRST_PIECE, k == 0u) | select(0u, LAST_PIECE, k + 2u == knots_of(hair));
}

fn begin_of(listed: u32) -> u32 {
    return listed & ~(FIRST_PIECE | LAST_PIECE);
}

// First of a hair's rows.
fn row_of_hair(hair: u32) -> u32 {
    return first_knot(hair) + ROWS_BEFORE * hair;
}

// Row of a knot.
fn row_of_knot(knot: u32, hair: u32) -> u32 {
    return knot + ROWS_BEFORE * (hair + 1u);
}
