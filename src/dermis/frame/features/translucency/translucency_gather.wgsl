// Light that comes through thin parts, gathered where it enters.
//#include "bilinear.wgsl"
//#include "packed_light.wgsl"
//#include "translucent_pair.wgsl"

struct Entering {
    layer: u32, // of the blurred level that the sources read
    sources: u32,
    halved: u32, // how often the level's resolution is
    scale: f32, // factor from what the level holds to light
}

@group(0) @binding(0) var<uniform> entering: Entering;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var<storage, read> source_points: array<Source>;
@group(0) @binding(3) var<storage, read> slants: array<vec2u>; // as translucency_directions.wgsl has them
@group(0) @binding(4) var<storage, read_write> gathered: array<vec4u>; // light, and what passes deep slabs of it, as in packed_light.wgsl

const SIZE: u32 = 64u; // of a workgroup

fn level_at(at: vec2i) -> vec4f {
    let most = vec2i(textureDimensions(levels)) - 1;
    return textureLoad(levels, clamp(at, vec2i(0), most), entering.layer, 0);
}

@compute @workgroup_size(SIZE)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    let index = (group.y * groups.x + group.x) * SIZE + number;
    if (index >= entering.sources) {
        return;
    }
    let texel = source_points[index].texel;
    let place = (vec2f(f32(texel & 0xffffu), f32(texel >> 16u)) + 0.5) / f32(1u << entering.halved) - 0.5;
    let a = vec2i(floor(place));
    let w = entering.scale * bilinear_weights(place);
    let light = w.x * level_at(a) + w.y * level_at(a + vec2i(1, 0)) + w.z * level_at(a + vec2i(0, 1))
        + w.w * level_at(a + vec2i(1, 1));
    gathered[index] = vec4u(light_words(light.rgb), light_words(light.rgb * light_of(slants[index])));
}
