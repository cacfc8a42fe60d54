"""Five models of the surface, on skin, alone, and from close by: python gallery/09_lobes.py OUTPUT [HEAD].

Phong, Blinn-Phong, Torrance-Sparrow, Kelemen, two lobes: the same somewhat oily skin for all. Alone is what
a head without any colour still reflects, twice as bright.
"""

import sys
from dataclasses import replace

import numpy as np

import dermis
from dermis.scene.camera import cheek

MODELS = ("phong", "blinn-phong", "torrance-sparrow", "kelemen", "two-lobe")

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
black = replace(head, maps=replace(head.maps, colour=np.zeros((4, 4, 3), np.float32)))
near = dermis.portrait(head).model_copy(update={"frame_mm": 310})
renderer = dermis.Renderer()
rows = []
for body, camera, exposure in ((head, near, 1.0), (black, near, 2.0), (head, cheek(head), 1.0)):
    skins = [dermis.Skin(specular=model, oiliness=0.3) for model in MODELS]
    scenes = [dermis.Scene(body, camera=camera, skin=skin) for skin in skins]
    rows.append(
        np.hstack([renderer.render(one, size=(384, 384), atlas=1024, exposure=exposure) for one in scenes])
    )
dermis.write_image(sys.argv[1], np.vstack(rows))
