// Keeps points of strands outside the skin, see skin_grid.wgsl.
//#include "skin_grid.wgsl"

//#fill const SKIN_PUSHES: u32 = {skin_pushes};
//#fill const NEAR_SKIN_MM: f32 = {near_skin_mm}; // height above a vertex's plane from which no more vertices are looked up
//#fill const SKIN_CLEARANCE_RATIO: f32 = {skin_clearance_ratio}; // of the height to which points are pushed
//#fill const MAX_SKIN_PUSH_MM: f32 = {max_skin_push_mm};
//#fill const MAX_PUSH_PER_LENGTH: f32 = {max_push_per_length}; // largest push relative to the distance from the root

@group(0) @binding(7) var<storage, read> skin: array<u32>;

fn skin_vector(word: u32) -> vec3f {
    return bitcast<vec3f>(vec3u(skin[word], skin[word + 1u], skin[word + 2u]));
}

// Height of a point above the tangent plane of a vertex [mm].
fn height_above_vertex(p: vec3f, cell_word: u32) -> f32 {
    let vertex = skin_vertex_word(cell_word & ((1u << SKIN_INDEX_BITS) - 1u));
    return dot(p - skin_vector(vertex), skin_vector(vertex + 3u));
}

fn is_near_skin(p: vec3f) -> bool {
    let at = floor((p - SKIN_LOW) / SKIN_CELL_MM);
    if (any(at < vec3f(1.0)) || any(at >= vec3f(SKIN_CELLS - 1u))) {
        return false;
    }
    let word = skin[skin_cell_index(vec3u(at))];
    return word != EMPTY_CELL && height_above_vertex(p, word) < NEAR_SKIN_MM;
}

// Normal of the skin below a point, and the height of the point [mm]: means over the vertices that the eight cells around name.
fn skin_below(p: vec3f) -> vec4f {
    let low = vec3u(floor((p - SKIN_LOW) / SKIN_CELL_MM - 0.5));
    var sum = vec4f(0.0);
    for (var k = 0u; k < 8u; k += 1u) {
        let word = skin[skin_cell_index(low + vec3u(k & 1u, (k >> 1u) & 1u, k >> 2u))];
        if (word != EMPTY_CELL) {
            let vertex = skin_vertex_word(word & ((1u << SKIN_INDEX_BITS) - 1u));
            let away = p - skin_vector(vertex);
            let normal = skin_vector(vertex + 3u);
            sum += vec4f(normal, dot(away, normal)) / (dot(away, away) + 0.05);
        }
    }
    return sum / max(length(sum.xyz), 1e-12);
}

// clearance: height above the skin that strands should have at least [mm]
// from_root: distance from the root along the strand [mm]
fn outside_skin(point: vec3f, clearance: f32, from_root: f32) -> vec3f {
    let least = SKIN_CLEARANCE_RATIO * clearance;
    let most = min(MAX_PUSH_PER_LENGTH * from_root, MAX_SKIN_PUSH_MM);
    var p = point;
    for (var i = 0u; i < SKIN_PUSHES; i += 1u) {
        if (!is_near_skin(p)) {
            break;
        }
        let below = skin_below(p);
        if (below.w >= least) {
            break;
        }
        p += min(least - below.w, most) * below.xyz;
    }
    return p;
}
