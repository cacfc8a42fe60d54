"""Seams of the atlas, and their treatments.

Blurs work in the atlas, so light stops or bleeds at its seams. From left: no treatment, a colour around the
charts, blurs that narrow at chart edges, blurs that skip empty texels, a second layout with other seams, and
blurs that continue across the seam along the surface. Below each, four times its difference from the last.

Deck: S18
Sources: Dudash2007
Columns: 6
"""

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script

TREATMENTS = ("none", "clear-colour", "stretch-map", "alpha", "multi-uv", "stitch")


def draw(studio):
    head = studio.head("human")
    light = dermis.PointLight(position=(900, 420, 420), irradiance=(4, 4, 4))
    behind = dermis.Camera(position=(900, -200, -500), target=(52, -62, -28), frame_mm=105)
    skin = dermis.Skin(profile="skin1", specular="none")
    scene = dermis.Scene(head, lights=[light], camera=behind, skin=skin)
    panels = {name: studio.render_linear(scene, 0.6, seams=name) for name in TREATMENTS}
    right = panels["stitch"]
    return panels | {f"{name}: difference": 4 * np.abs(panels[name] - right) for name in TREATMENTS}


if __name__ == "__main__":
    run_gallery_script(draw)
