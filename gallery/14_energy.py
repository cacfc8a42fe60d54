"""What is reflected does not enter: python gallery/14_energy.py OUTPUT [HEAD].

Left to right: no energy term, the published one, the full one. Above the head. Below the same head in white
under even light: it should give back just what it gets, which is grey; blue is up to 10 % too dark, red as
much too bright.
"""

import sys
from dataclasses import replace

import numpy as np
from matplotlib import colormaps

import dermis
from dermis.images.colour import encode_srgb8
from dermis.images.io import write_png

SIZE = {"size": (448, 448), "atlas": 1024}

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
white = replace(head, maps=replace(head.maps, colour=np.ones((4, 4, 3), np.float32)))
renderer = dermis.Renderer()
camera = dermis.three_quarter(head)
even = dermis.Environment(name="uniform")
heads, furnaces = [], []
for energy in ("none", "published", "full"):
    skin = dermis.Skin(energy=energy)
    heads.append(encode_srgb8(renderer.render(dermis.Scene(head, camera=camera, skin=skin), **SIZE)))
    furnace = dermis.Scene(white, camera=camera, skin=skin, environment=even)
    returned = renderer.render(furnace, occlusion="none", **SIZE)[..., 1]
    tinted = colormaps["coolwarm"](np.clip((returned - 0.9) / 0.2, 0, 1))[..., :3]
    furnaces.append(np.uint8(255 * tinted * (returned > 0.2)[..., None]))
write_png(sys.argv[1], np.vstack([np.hstack(heads), np.hstack(furnaces)]))
