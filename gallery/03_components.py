"""The two components of skin.

The reflection off the oily surface is white and shows every pore. Light scattered below the surface is soft
and has the colour of the skin. Skin is the sum of both.

Deck: S2, S7
Equation: L = L_reflected + L_scattered
Sources: Dudash2007, Tuchin2000
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

PARTS = {"reflected": "specular", "scattered": "diffuse", "both": "all"}


def draw(studio):
    head = studio.head()
    scene = dermis.Scene(head, camera=dermis.three_quarter(head))
    return {name: studio.render(scene, parts=part) for name, part in PARTS.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
