// Writes every scalar of a struct, in order, to the texels of a row.

struct Inner {
    vector: vec3f,
    whole: u32,
}

struct Probe {
    lone: f32,
    three: vec3f,
    matrix: mat4x4f, // as numpy writes it: row k here is column k there
    pair: vec2f,
    inner: array<Inner, 2>,
    last: i32,
}

@group(0) @binding(0) var<uniform> probe: Probe;
@group(0) @binding(1) var read: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (any(id.xy > vec2u(0u))) {
        return;
    }
    var values: array<f32, 31>;
    values[0] = probe.lone;
    for (var k = 0u; k < 3u; k++) {
        values[1u + k] = probe.three[k];
    }
    for (var k = 0u; k < 16u; k++) {
        values[4u + k] = probe.matrix[k / 4u][k % 4u];
    }
    values[20] = probe.pair.x;
    values[21] = probe.pair.y;
    for (var k = 0u; k < 2u; k++) {
        for (var c = 0u; c < 3u; c++) {
            values[22u + 4u * k + c] = probe.inner[k].vector[c];
        }
        values[25u + 4u * k] = f32(probe.inner[k].whole);
    }
    values[30] = f32(probe.last);
    for (var k = 0u; k < 31u; k++) {
        textureStore(read, vec2u(k, 0u), vec4f(values[k]));
    }
}
