// The list of texels beyond the charts' edges.

struct Beyond {
    source: vec2f, // where the light is [texel], whole numbers at texel centres
    texel: vec2u, // where it is shown
}

@group(0) @binding(0) var<storage, read> gutter: array<Beyond>;

const ROW: u32 = 1024u; // entries in a row of invocations
