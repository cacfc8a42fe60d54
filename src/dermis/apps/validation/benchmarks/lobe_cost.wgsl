// Cost of a lobe: each invocation evaluates it at a point of a ball for many lights, seen from the front.
//#include "surface/lobe.wgsl"

override LIGHTS: u32 = 16u; // per point
override IDLE: bool = false; // omits the lobe, to measure the cost of the loop alone

@group(0) @binding(30) var sums: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2f(textureDimensions(sums));
    let uv = (vec2f(id.xy) + 0.5) / size;
    let n = normalize(vec3f(uv - 0.5, 0.5));
    let m = 0.1 + 0.4 * uv.x;
    var sum = 0.0;
    for (var i = 0u; i < LIGHTS; i++) {
        let azimuth = 2.4 * f32(i);
        let l = normalize(vec3f(0.6 * cos(azimuth), 0.6 * sin(azimuth), 1.0));
        if (IDLE) {
            sum += dot(n, l) * m;
        } else {
            sum += lobe(n, l, vec3f(0.0, 0.0, 1.0), m);
        }
    }
    textureStore(sums, id.xy, vec4f(sum));
}
