// Coverage of each pixel by head and hair, over all samples.
//#include "output_images.wgsl"

//#include <alpha_outputs>
//#each alpha_outputs: override {NAME}_FIRST: u32 = NOT_REQUESTED;

@group(0) @binding(50) var exposed: texture_2d<f32>;

fn alpha_output(pixel: vec2u) -> f32 {
    return textureLoad(exposed, pixel, 0).a;
}

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(exposed);
    if (any(id.xy >= size)) {
        return;
    }
    //#each alpha_outputs: write_{type}({NAME}_FIRST, pixel_slot(id.xy, size), {name}_output(id.xy));
}
