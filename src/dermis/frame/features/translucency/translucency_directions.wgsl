// Direction factor of each source: transmittance of a deep slab for the light at the source, relative to the transmittance for
// uniform light with the same diffuse reflectance.
//#include "irradiance/lighting.wgsl"
//#include "irradiance/texels_beside.wgsl"
//#include "packed_light.wgsl"
//#include "translucent_source.wgsl"

struct SourceCount {
    sources: u32,
}

@group(0) @binding(31) var<uniform> source_count: SourceCount;
@group(0) @binding(32) var<storage, read> source_points: array<Source>;
@group(0) @binding(33) var<storage, read_write> direction_factors: array<vec2u>; // see packed_light.wgsl

const SIZE: u32 = 64u; // of a workgroup

@compute @workgroup_size(SIZE)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) number: u32,
) {
    let index = (group.y * groups.x + group.x) * SIZE + number;
    if (index >= source_count.sources) {
        return;
    }
    let texel = vec2u(source_points[index].texel & 0xffffu, source_points[index].texel >> 16u);
    let packed = packed_at(vec2i(texel));
    var factor = vec3f(1.0); // for uniform light
    if (packed.appearance.w != 0u) {
        let surface = unpack_surface(packed);
        var point = unpack_point(packed);
        point.atlas_uv = (vec2f(texel) + 0.5) / vec2f(textureDimensions(surfaces));
        if (OBLIQUE) {
            local_bend = bend_at(vec2i(texel), packed.geometry);
        }
        let lit = illuminate(point, surface, surface.normal, open_at(point.atlas_uv));
        factor = select(factor, lit.across / max(lit.entered, vec3f(1e-20)), lit.entered > vec3f(0.0));
    }
    direction_factors[index] = pack_light(factor);
}
