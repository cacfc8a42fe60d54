// Freckles, moles, age spots, stubble, blemishes and scars: dots whose density depends on the person and on the zones of the face.
//#include "spot.wgsl"

fn scatter_dots(spot: Spot, scalp: f32, lip: f32) {
    var density: array<f32, DOTS>;
    let sun = saturate(zone_of(ZONE_SUN));
    let freckled = paint.freckles * (0.12 + 0.88 * sun) * (0.75 + 0.75 * noise[NOISE_SUN]) * (1.0 - lip);
    density[DOT_FRECKLES] = 0.7 * freckled;
    density[DOT_SMALL_FRECKLES] = freckled;
    density[DOT_MOLES] = 0.3 * paint.moles * (1.0 - lip);
    density[DOT_AGE_SPOTS] = 0.8 * paint.spots * (0.1 + 0.9 * sun) * (1.0 - lip);
    let prone = (0.25 + saturate(zone_of(ZONE_CAPILLARIES))) * (1.0 - lip) * (1.0 - scalp);
    density[DOT_BLEMISHES] = 0.6 * paint.blemishes * prone;
    density[DOT_SCARS] = 0.8 * paint.scars * prone;
    density[DOT_STUBBLE] = select(0.0, 1.0, max(scalp * paint.stubble, saturate(zone_of(ZONE_BEARD)) * paint.beard) > 0.0);
    for (var k = 0u; k < DOTS; k++) {
        dotted[k] = 0.0;
        if (density[k] > 0.0) {
            let kind = tables.dot_kinds[k];
            let bent = spot.body + kind.ragged_mm * vec3f(noise[NOISE_RAGGED_X], noise[NOISE_RAGGED_Y], 0.0);
            dotted[k] = dots(bent, spot.normal, kind, density[k], spot.texel_mm, 64u * paint.seed + 40u + 2u * k);
        }
    }
}
