// Slopes of a height map along u and down the map [mm/texel] by Scharr's filter, the squares of the slopes, and the first mip
// level.
//#include "store.wgsl"

@group(0) @binding(0) var<storage, read> top: array<u32>; // first row of the band
@group(0) @binding(1) var<storage, read> heights: array<f32>; // of the band, with a border of one texel [mm]
@group(0) @binding(33) var halved: texture_storage_2d<rgba16float, write>;

const ROWS: u32 = 32u; // per invocation, which handles two columns and reuses the rows that it has read

// Differences across two columns of a row, and sums of three heights weighted by 3, 10, 3.
struct Row {
    change: vec2f,
    sum: vec2f,
}

fn row(first: u32) -> Row {
    let a = vec2f(heights[first], heights[first + 1u]);
    let b = vec2f(heights[first + 2u], heights[first + 3u]);
    return Row(b - a, 3.0 * (a + b) + 10.0 * vec2f(a.y, b.x));
}

fn with_squares(slope: vec2f) -> vec4f {
    return vec4f(slope, slope * slope);
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(stored);
    let pitch = size.x + 2u;
    let x = 2u * id.x;
    let low = top[0] + ROWS * id.y;
    if (x >= size.x || ROWS * id.y * pitch >= arrayLength(&heights)) {
        return;
    }
    var at = ROWS * id.y * pitch + x;
    var above = row(at);
    var centre = row(at + pitch);
    var quad = vec4f(0.0);
    for (var y = low; y < min(low + ROWS, size.y); y++) {
        let below = row(at + 2u * pitch);
        let across = (3.0 * (above.change + below.change) + 10.0 * centre.change) / 32.0;
        let down = (below.sum - above.sum) / 32.0;
        let left = with_squares(vec2f(across.x, down.x));
        let right = with_squares(vec2f(across.y, down.y));
        store(vec2u(x, y), left);
        store(vec2u(x + 1u, y), right);
        quad += left + right;
        if (y % 2u == 1u) {
            textureStore(halved, vec2u(x, y) / 2u, rounded_to_halves(0.25 * quad));
            quad = vec4f(0.0);
        }
        above = centre;
        centre = below;
        at += pitch;
    }
}
