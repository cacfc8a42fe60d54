// Surfaces of parts that are not skin, as glTF's metallic-roughness model describes them.
//#include "surface/skin.wgsl"

override PARTS: bool = false; // whether the head has such parts of a file
override WORN: bool = false; // whether the head wears cloth or glasses

const WET_ROUGHNESS: f32 = 0.1; // of plain materials: teeth, tongues, eyeballs of files
const MIN_PART_ROUGHNESS: f32 = 0.05; // least Beckmann roughness of the tables

struct PartMaterial {
    emission: vec3f, // radiance
    roughness: f32, // perceptual; negative for the wet surface of plain materials
    metalness: f32,
    weave: u32, // structure of cloth, see fabric.wgsl; 0 for other surfaces
    thread_mm: f32, // distance of its threads
    relief: f32, // slope of its threads
    contrast: f32, // of the brightness of its threads
    crumple: f32, // slope of its small wrinkles
    sheen: f32, // strength of its lobe at grazing angles
    has_maps: u32, // 1 if `part_maps` has colour, slopes, roughness and metalness
}

struct PartSurface {
    surface: Surface,
    metalness: f32,
    emission: vec3f,
    sheen: vec3f,
}

//#if PARTS
@group(0) @binding(16) var part_maps: texture_2d_array<f32>; // filtered: colour; slopes, roughness, metalness; emission

const EMISSION_LAYER: i32 = 2;

fn part_texel(uv: vec2f, layer: i32, footprint: f32) -> vec4f {
    let size = vec2f(textureDimensions(part_maps));
    let mip = max(0.0, log2(footprint * max(size.x, size.y)));
    return textureSampleLevel(part_maps, map_sampler, uv, layer, mip);
}

fn part_at(point: Point, colour: vec3f, material: PartMaterial, footprint: f32) -> PartSurface {
    var part = PartSurface(Surface(point.normal, colour, WET_ROUGHNESS, 1.0), material.metalness, material.emission, vec3f(0.0));
    var roughness = material.roughness;
    if (material.has_maps != 0u) {
        let own = part_texel(point.uv, 1, footprint);
        part.surface.colour = part_texel(point.uv, 0, footprint).rgb;
        part.surface.normal = bend(point, vec2f(own.x * length(point.dpdu), -own.y * length(point.dpdv)));
        part.metalness = own.w;
        roughness = select(own.z, roughness, roughness < 0.0);
        if (textureNumLayers(part_maps) > u32(EMISSION_LAYER)) {
            part.emission = part_texel(point.uv, EMISSION_LAYER, footprint).rgb;
        }
    }
    if (roughness >= 0.0) {
        part.surface.roughness = max(roughness * roughness, MIN_PART_ROUGHNESS);
    }
    return part;
}
//#else
//#if WORN
//#include "fabric.wgsl"

const SHEEN_WHITENESS: f32 = 0.5; // fraction of white in the colour of the sheen, as upright fibres also scatter light at their surfaces

fn part_at(point: Point, colour: vec3f, material: PartMaterial, footprint: f32) -> PartSurface {
    var part = PartSurface(Surface(point.normal, colour, WET_ROUGHNESS, 1.0), material.metalness, material.emission, vec3f(0.0));
    if (material.weave != 0u) {
        part.surface = cloth_at(point, colour, material, footprint);
        part.sheen = material.sheen * mix(colour, vec3f(1.0), SHEEN_WHITENESS);
    } else if (material.roughness >= 0.0) {
        part.surface.roughness = max(material.roughness * material.roughness, MIN_PART_ROUGHNESS);
    }
    return part;
}
//#else
fn part_at(point: Point, colour: vec3f, material: PartMaterial, footprint: f32) -> PartSurface {
    return PartSurface(Surface(point.normal, colour, WET_ROUGHNESS, 1.0), 0.0, vec3f(0.0), vec3f(0.0));
}
//#end
//#end
