// Light beyond a chart's edge, from where the surface truly goes on: gathered into a list, then put in its place.
//#include "bilinear.wgsl"

override PLACE: bool = false; // false: gather; true: put in place

struct Beyond {
    source: vec2f, // where the light is [texel], whole numbers at texel centres
    texel: vec2u, // that shows it
}

@group(0) @binding(0) var<storage, read> apron: array<Beyond>;
@group(0) @binding(1) var<storage, read_write> gathered: array<vec4f>;
@group(0) @binding(2) var light: texture_2d<f32>;
@group(0) @binding(3) var stitched: texture_storage_2d<rgba32float, write>;

const ROW: u32 = 1024u; // of the list, as it is spread over invocations

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let index = id.y * ROW + id.x;
    if (id.x >= ROW || index >= arrayLength(&apron)) {
        return;
    }
    let beyond = apron[index];
    if (PLACE) {
        textureStore(stitched, beyond.texel, gathered[index]);
        return;
    }
    gathered[index] = load_bilinear(light, (beyond.source + 0.5) / vec2f(textureDimensions(light)));
}
