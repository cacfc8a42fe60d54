// A point and its surface packed and taken apart again.
//#include "irradiance/lighting.wgsl"
//#include "surface/packed_surface.wgsl"

@group(0) @binding(30) var directions: texture_2d<f32>; // normals
@group(0) @binding(31) var colours: texture_2d<f32>; // and the height over the facet
@group(0) @binding(32) var normal: texture_storage_2d<rgba32float, write>;
@group(0) @binding(33) var bent: texture_storage_2d<rgba32float, write>;
@group(0) @binding(34) var colour: texture_storage_2d<rgba32float, write>;
@group(0) @binding(35) var places: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let n = textureLoad(directions, id.xy, 0).xyz;
    let given = textureLoad(colours, id.xy, 0);
    var point: Point;
    point.position = 100.0 * n.yzx;
    point.normal = n;
    point.lit_position = point.position + given.a * n;
    let gloss = 0.5 + 0.4 * n.xy; // no constants: of those, Mesa 22.3 unpacks the upper half as 0
    let packed = pack_surface(point, Surface(-n, given.rgb, gloss.x, gloss.y));
    let unpacked = unpack_point(packed);
    let surface = unpack_surface(packed);
    textureStore(normal, id.xy, vec4f(unpacked.normal, surface.roughness));
    textureStore(bent, id.xy, vec4f(surface.normal, surface.rho_s));
    textureStore(colour, id.xy, vec4f(surface.colour, 0.0));
    textureStore(places, id.xy, vec4f(unpacked.position, distance(unpacked.lit_position, unpacked.position)));
}
