// Light that enters thin parts, sampled at each source.
//#include "bilinear.wgsl"
//#include "packed_light.wgsl"
//#include "translucent_pair.wgsl"

struct Entering {
    layer: u32, // of the blurred level that sources sample
    sources: u32,
    halvings: u32, // of the resolution of that level
    scale: f32, // factor from values of the level to light
}

@group(0) @binding(0) var<uniform> entering: Entering;
@group(0) @binding(1) var levels: texture_2d_array<f32>;
@group(0) @binding(2) var<storage, read> source_points: array<Source>;
@group(0) @binding(3) var<storage, read> direction_factors: array<vec2u>; // see translucency_directions.wgsl
@group(0) @binding(4) var<storage, read_write> source_light: array<vec4u>; // packed light, and packed light times its direction factor

const SIZE: u32 = 64u; // of a workgroup

fn level_at(at: vec2i) -> vec4f {
    let last = vec2i(textureDimensions(levels)) - 1;
    return textureLoad(levels, clamp(at, vec2i(0), last), entering.layer, 0);
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
    let position = (vec2f(f32(texel & 0xffffu), f32(texel >> 16u)) + 0.5) / f32(1u << entering.halvings) - 0.5;
    let a = vec2i(floor(position));
    let w = entering.scale * bilinear_weights(position);
    let light = w.x * level_at(a) + w.y * level_at(a + vec2i(1, 0)) + w.z * level_at(a + vec2i(0, 1))
        + w.w * level_at(a + vec2i(1, 1));
    source_light[index] = vec4u(pack_light(light.rgb), pack_light(light.rgb * unpack_light(direction_factors[index])));
}
