// Slopes of a height map along +u and down [mm per texel], Scharr's, and their squares; a plane goes on beyond the edge.
//#include "store.wgsl"

@group(0) @binding(0) var height_map: texture_2d<f32>; // [mm]

const ROWS: i32 = 32; // of an invocation, which takes two columns: what it has read it keeps

// At two columns of a row: what is right of each less what is left, and the three by 3, 10, 3.
struct Row {
    change: vec2f,
    sum: vec2f,
}

fn height_at(x: i32, y: i32) -> f32 {
    return textureLoad(height_map, vec2i(x, y), 0).r;
}

fn row_within(x: i32, y: i32) -> Row {
    let last = i32(textureDimensions(height_map).x) - 1;
    let a = height_at(x, y);
    var before = height_at(select(x - 1, min(1, last), x == 0), y);
    before = select(before, 2.0 * a - before, x == 0);
    let b = select(height_at(min(x + 1, last), y), 2.0 * a - before, x == last);
    let after = select(height_at(min(x + 2, last), y), 2.0 * b - a, x + 1 >= last);
    return Row(vec2f(b, after) - vec2f(before, a), 3.0 * (vec2f(b, after) + vec2f(before, a)) + 10.0 * vec2f(a, b));
}

fn row(x: i32, y: i32) -> Row {
    let last = i32(textureDimensions(height_map).y) - 1;
    let edge = clamp(y, 0, last);
    let found = row_within(x, edge);
    if (edge == y) {
        return found;
    }
    let inner = row_within(x, clamp(2 * edge - y, 0, last));
    return Row(2.0 * found.change - inner.change, 2.0 * found.sum - inner.sum);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2i(textureDimensions(height_map));
    let x = 2 * i32(id.x);
    let top = i32(id.y) * ROWS;
    if (x >= size.x) {
        return;
    }
    var above = row(x, top - 1);
    var centre = row(x, top);
    for (var y = top; y < min(top + ROWS, size.y); y++) {
        let below = row(x, y + 1);
        let across = (3.0 * (above.change + below.change) + 10.0 * centre.change) / 32.0;
        let down = (below.sum - above.sum) / 32.0;
        let slopes = vec4f(across.x, down.x, across.y, down.y);
        store(vec2u(vec2i(x, y)), vec4f(slopes.xy, slopes.xy * slopes.xy));
        store(vec2u(vec2i(x + 1, y)), vec4f(slopes.zw, slopes.zw * slopes.zw));
        above = centre;
        centre = below;
    }
}
