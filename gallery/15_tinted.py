"""White reflections, and reflections in the skin's colour: python gallery/15_tinted.py OUTPUT [HEAD].

Skin is no metal: what its surface reflects has the colour of the light (left). Tinted by the colour map
(right) it looks like painted clay. Oily skin in the lower row shows it best.
"""

import sys

import numpy as np

import dermis

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
renderer = dermis.Renderer()
rows = []
for oiliness in (0.0, 0.6):
    skins = [dermis.Skin(specular_colour=colour, oiliness=oiliness) for colour in ("white", "wrong")]
    scenes = [dermis.Scene(head, camera=dermis.three_quarter(head), skin=skin) for skin in skins]
    rows.append(np.hstack([renderer.render(scene, size=(512, 512), atlas=1024) for scene in scenes]))
dermis.write_image(sys.argv[1], np.vstack(rows))
