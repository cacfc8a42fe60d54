// Layout of strands in buffers: normal of the skin, absorption, and the knots from root to tip. Fine strands (brows and
// lashes) come first, then coarse strands (scalp hair and beard); if only some coarse strands are drawn, they are wider.

const ROWS_BEFORE: u32 = 2u; // rows of a strand before its knots: normal of the skin, and radius by which light is absorbed,
// 0 for that of the knots; absorption [1/mm], and packed: cover by other hair, and from where the strand is dyed
const COVER_STEPS: f32 = 64.0; // the packed number is floor(COVER_STEPS cover) + fraction of the strand that is not dyed, or + 0

struct Hairs {
    fine: u32, // number of strands
    coarse: u32,
    shadow_casters: u32, // coarse strands that cast shadows
    fine_knots: u32, // knots per strand
    coarse_knots: u32,
    width_scale: f32, // factor of the width of coarse strands, so that they cover the area of all
    absorptance: f32, // fraction of diffuse light that a hair absorbs, mean of all colours
    dye: vec3f, // absorption of dyed strands [1/mm]
}

@group(0) @binding(41) var<uniform> hairs: Hairs;

// Index of the strand that has a knot or segment; of_fine, of_coarse: number of knots or segments of a fine or coarse strand.
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

fn hair_of_segment(segment: u32) -> u32 {
    return hair_of(segment, hairs.fine_knots - 1u, hairs.coarse_knots - 1u);
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

// Number of segments of all fine strands and of the first `coarse` coarse ones.
fn segment_count(coarse: u32) -> u32 {
    return hairs.fine * (hairs.fine_knots - 1u) + coarse * (hairs.coarse_knots - 1u);
}

fn total_knot_count(coarse: u32) -> u32 {
    return hairs.fine * hairs.fine_knots + coarse * hairs.coarse_knots;
}

// Packed segment: its first knot, and whether it is the first and the last one of a strand.
const FIRST_SEGMENT: u32 = 0x40000000u;
const LAST_SEGMENT: u32 = 0x80000000u;

fn pack_segment(begin: u32, hair: u32) -> u32 {
    let k = begin - first_knot(hair);
    return begin | select(0u, FIRST_SEGMENT, k == 0u) | select(0u, LAST_SEGMENT, k + 2u == knots_of(hair));
}

fn first_knot_of(packed: u32) -> u32 {
    return packed & ~(FIRST_SEGMENT | LAST_SEGMENT);
}

// First row of a strand.
fn row_of_hair(hair: u32) -> u32 {
    return first_knot(hair) + ROWS_BEFORE * hair;
}

// Row of a knot.
fn row_of_knot(knot: u32, hair: u32) -> u32 {
    return knot + ROWS_BEFORE * (hair + 1u);
}
