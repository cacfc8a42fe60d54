// Sources: cells where light enters a thin part.

struct Source {
    centre: vec3f,
    area: f32, // [mm^2]
    normal: vec3f,
    texel: u32, // of the atlas, x and y packed
}
