"""Scanned detail, off and on.

The mesh alone is smooth. Pores and wrinkles come from a normal map and from a height map of up to 4096
texels a side, in mm. Detail that is too fine for a pixel makes its surface rougher instead.

Deck: S1
Sources: dEonLuebke2007, OlanoBaker2010
Slider: mesh alone | with its maps
"""

from dataclasses import replace

import dermis
from dermis.apps.gallery.script import draw_script
from dermis.scene.camera import cheek


def draw(studio):
    head = studio.head()
    smooth = replace(head, maps=replace(head.maps, normal=None, height=None))
    camera = cheek(head).model_copy(update={"frame_mm": 95})
    bodies = {"mesh alone": smooth, "with its maps": head}
    return {name: studio.render(dermis.Scene(body, camera=camera), 1.6) for name, body in bodies.items()}


if __name__ == "__main__":
    draw_script(draw)
