"""Lighting with linear values and with gamma-encoded ones.

Colour maps are decoded, light is added linearly, and the picture is encoded at the end. Without decoding and
encoding, colours are too saturated and shading falls off too fast.

Deck: S23
Sources: SRGB1999, Dudash2007
Slider: linear (correct) | encoded (wrong)
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    scene = dermis.Scene(studio.head(), camera=dermis.three_quarter(studio.head()))
    ways = {"linear (correct)": "right", "encoded (wrong)": "wrong"}
    return {label: studio.render(scene, 1.4, gamma=gamma) for label, gamma in ways.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
