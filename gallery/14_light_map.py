"""Light on the unwrapped skin.

The surface of the head is flattened to the atlas, each texel is lit at its position on the head, and the
light is blurred in the atlas: the incoming light, a blur of medium width, and the widest. The gutters between
the charts are filled with light from across the seam, as far as the blurs reach.

Deck: S15
Equation: E(texel) = Σ_lights E max(N·L, 0) V (1 − ρ_s ρ_dt) albedo^mix
Sources: Borshukov2003, Green2004, dEonLuebke2007
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

LEVELS = {"light that enters": 0, "blurred, third level": 3, "blurred, widest level": 5}


def draw(studio):
    scene = dermis.Scene(studio.head())
    return {label: 0.3 * studio.light_map(scene, level) for label, level in LEVELS.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
