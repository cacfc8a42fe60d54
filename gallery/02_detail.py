"""Scanned detail, off and on.

The mesh alone is smooth. Pores and wrinkles are in a normal map and in a height map of up to 4096 texels per
side, in mm. Detail that is finer than a pixel increases the roughness instead.

Deck: S1
Sources: dEonLuebke2007, OlanoBaker2010
Slider: mesh alone | with its maps
"""

from dataclasses import replace

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.scene.camera import cheek


def draw(studio):
    head = studio.head()
    smooth = replace(head, maps=replace(head.maps, normal=None, height=None))
    camera = cheek(head).model_copy(update={"frame_mm": 95})
    bodies = {"mesh alone": smooth, "with its maps": head}
    return {name: studio.render(dermis.Scene(body, camera=camera), 1.6) for name, body in bodies.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
