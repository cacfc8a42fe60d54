// List of gutter texels.

struct GutterTexel {
    source: vec2f, // position whose light is copied [texels]; integers are texel centres
    texel: vec2u,
}

@group(0) @binding(0) var<storage, read> gutter: array<GutterTexel>;

const ROW: u32 = 1024u; // entries in a row of invocations
