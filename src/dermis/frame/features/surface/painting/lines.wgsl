// Height of the skin above its smooth surface, in as much detail as maps resolve [mm].
//#include "spot.wgsl"

// Artistic values.
const MOVEMENT_DEPTH: f32 = 0.45; // depth that a full movement adds to a fold, relative to its depth in an old face
const MOVEMENT_DEPTH_AGE: f32 = 0.5;
const MOVEMENT_WIDTH: f32 = 2.0; // width of a fold of moved skin relative to its width at rest: skin bulges softly
const MOVEMENT_WIDTH_AGE: f32 = -0.5;
const MOVED_FOLD_AT_REST: f32 = 0.35; // depth in a young face at rest, of folds that movements deepen
const FOLD_AGES: vec2f = vec2f(0.08, 1.1); // ages between which folds remain at rest, 0 to 1
const GRAIN_MM: f32 = 0.040;
const LINE_MM: f32 = 0.07;
const CREASE_MM: f32 = 0.10;
const MOLE_MM: f32 = 0.18;
const BLEMISH_MM: f32 = 0.24;
const SCAR_MM: f32 = 0.22;

// Depth of a groove along the zeros of a noise n, made wider and shallower where texels do not resolve it.
fn groove(n: f32, sharpness: f32, texel_mm: f32, blob_mm: f32) -> f32 {
    let finest = min(sharpness, 0.45 * blob_mm / texel_mm);
    let side = max(1.0 - abs(n) * finest, 0.0);
    return side * side * finest / sharpness * visible(blob_mm, texel_mm);
}

var<private> deepened: array<f32, FOLDING>; // height that each full movement adds [mm]

fn relief(spot: Spot, lip: f32) -> f32 {
    let texel = spot.texel_mm;
    let bare = max(1.0 + zone_of(ZONE_FURROWS), 0.2) * (1.0 - 0.85 * lip);
    var height = bare * GRAIN_MM * (0.6 + 0.5 * noise[NOISE_ROUGHNESS]) * noise[NOISE_GRAIN];
    let uneven = max(0.45 + 0.9 * noise[NOISE_LINE_DEPTH], 0.0);
    let lines = zone_of(ZONE_LEVEL) * uneven * groove(noise[NOISE_LEVEL_LINES], 3.5, texel, 1.5)
        + zone_of(ZONE_AROUND) * (0.3 + uneven) * 0.9 * groove(noise[NOISE_EYE_LINES], 3.0, texel, 1.1);
    height -= (0.3 + 4.0 * paint.age) * LINE_MM * lines;
    let creases = (0.6 + 0.6 * noise[NOISE_CREASE_DEPTH]) * groove(noise[NOISE_CREASES], 2.2, texel, 1.7)
        + 0.3 * groove(noise[NOISE_FINE_CREASES], 2.5, texel, 0.8);
    height -= lip * CREASE_MM * creases * smoothstep(0.2, 2.0, abs(spot.fields.y));
    height += MOLE_MM * smoothstep(0.1, 0.6, dotted[DOT_MOLES]) + BLEMISH_MM * smoothstep(0.05, 0.5, dotted[DOT_BLEMISHES]);
    return height - SCAR_MM * smoothstep(0.05, 0.7, dotted[DOT_SCARS]) + fold_height(spot);
}

// Height of the folds of the face, with slightly raised borders; sets the heights that movements add.
fn fold_height(spot: Spot) -> f32 {
    var height = 0.0;
    for (var k = 0u; k < FOLDING; k++) {
        deepened[k] = 0.0;
    }
    let bend = vec3f(
        0.7 * noise[NOISE_FOLD_BEND_X] + 0.3 * noise[NOISE_FINE_FOLD_BEND],
        0.7 * noise[NOISE_FOLD_BEND_Y] - 0.3 * noise[NOISE_FINE_FOLD_BEND],
        0.0,
    );
    let p = spot.left + FOLD_WANDER_MM * bend;
    var k = 0u;
    loop { // over the folds that reach this texel; nested loops as in make_noise
        loop {
            if (k >= FOLDS) {
                break;
            }
            if (reaches(tables.folds[k], p, spot.texel_mm)) {
                break;
            }
            k++;
        }
        if (k >= FOLDS) {
            break;
        }
        let fold = tables.folds[k];
        let width = width_of(fold, spot.texel_mm);
        let near = nearest(p, fold.knots);
        let square = near.x / (width * width);
        let ends = 1.0 - pow(2.0 * near.y - 1.0, 4.0);
        let part = ends * fold.size.x / width * max(0.8 + 0.6 * noise[NOISE_LINE_DEPTH], 0.0);
        let moves = fold.size.w > 0.0;
        let young = fold.size.y * select(1.0, MOVED_FOLD_AT_REST, moves);
        height += mix(young, fold.size.z, smoothstep(FOLD_AGES.x, FOLD_AGES.y, paint.age)) * part * fold_shape(square);
        if (moves) {
            let relative_width = MOVEMENT_WIDTH + MOVEMENT_WIDTH_AGE * paint.age;
            let depth = (MOVEMENT_DEPTH + MOVEMENT_DEPTH_AGE * paint.age) * fold.size.z;
            deepened[u32(fold.size.w) - 1u] += depth * part * fold_shape(square / (relative_width * relative_width)) * fold_reach(square);
        }
        k++;
    }
    return height;
}

// Profile of a fold with raised borders: squared distance from its middle in squared widths.
fn fold_shape(square: f32) -> f32 {
    return (0.35 * exp(-square / 7.0) - exp(-square)) * fold_reach(square);
}

fn fold_reach(square: f32) -> f32 {
    return 1.0 - smoothstep(0.6 * FOLD_REACH * FOLD_REACH, FOLD_REACH * FOLD_REACH, square);
}

fn reaches(fold: Fold, p: vec3f, texel_mm: f32) -> bool {
    return distance(p, fold.ball.xyz) < fold.ball.w + FOLD_REACH * width_of(fold, texel_mm);
}

// Squared distance to a fold [mm2], and position along it.
fn nearest(p: vec3f, knots: vec4f) -> vec2f {
    var found = vec2f(1e9, 0.0);
    var k = u32(knots.x);
    var knot = tables.knots[k];
    loop { // with the test at the end, as in lighting.wgsl
        k++;
        let next = tables.knots[k];
        let along = next - knot;
        let off = p - knot.xyz;
        let t = saturate(dot(off, along.xyz) / dot(along.xyz, along.xyz));
        let away = off - t * along.xyz;
        let square = dot(away, away);
        if (square < found.x) {
            found = vec2f(square, knot.w + t * along.w);
        }
        knot = next;
        if (k >= u32(knots.y)) {
            break;
        }
    }
    return found;
}
