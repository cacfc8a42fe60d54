// Light that comes through thin parts: gathered where it enters, then summed where it leaves.
//#include "bilinear.wgsl"

override SUM: bool = false; // false: gather; true: sum

struct Through {
    layer: u32, // blurred level that the sources show
    side: u32, // of the coarse atlas
    sources: u32,
    mip: u32, // that holds the level
    scale: f32, // of the light over what the level holds
}

@group(0) @binding(0) var<uniform> through: Through;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var<storage, read> sources: array<vec2u>; // texel, x and y packed; area
@group(0) @binding(3) var<storage, read> receiver: array<u32>; // of each cell: 0 without surface, else which one
@group(0) @binding(4) var<storage, read> first: array<u32>; // where each receiver's links begin
@group(0) @binding(5) var<storage, read> links: array<vec2u>; // source, and the share of its light, as in opposite.wgsl
@group(0) @binding(6) var<storage, read_write> gathered: array<vec4f>;
@group(0) @binding(7) var transmitted: texture_storage_2d<rgba32float, write>;

const ROW: u32 = 1024u; // of the sources, as they are spread over invocations

fn level_at(at: vec2i) -> vec4f {
    let most = vec2i(textureDimensions(levels, through.mip)) - 1;
    return textureLoad(levels, clamp(at, vec2i(0), most), through.layer, through.mip);
}

fn gather(index: u32) {
    let texel = sources[index].x;
    let place = (vec2f(f32(texel & 0xffffu), f32(texel >> 16u)) + 0.5) / f32(1u << through.mip) - 0.5;
    let a = vec2i(floor(place));
    let w = through.scale * bilinear_weights(place);
    gathered[index] = w.x * level_at(a) + w.y * level_at(a + vec2i(1, 0)) + w.z * level_at(a + vec2i(0, 1))
        + w.w * level_at(a + vec2i(1, 1));
}

// Three shares with one exponent.
fn decoded(word: u32) -> vec3f {
    return exp2(f32(word >> 27u) - 24.0) * vec3f(f32(word & 511u), f32((word >> 9u) & 511u), f32((word >> 18u) & 511u));
}

fn add_up(at: vec2u) {
    let which = receiver[at.y * through.side + at.x];
    var sum = vec3f(0.0);
    for (var k = first[which]; k < first[which + 1u]; k++) {
        let link = links[k];
        sum += decoded(link.y) * gathered[link.x].rgb;
    }
    textureStore(transmitted, at, vec4f(sum, select(0.0, 1.0, which > 0u)));
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (SUM) {
        if (all(id.xy < vec2u(through.side))) {
            add_up(id.xy);
        }
        return;
    }
    let index = id.y * ROW + id.x;
    if (id.x < ROW && index < through.sources) {
        gather(index);
    }
}
