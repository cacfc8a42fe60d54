"""Light counted in linear numbers and in encoded ones: python gallery/13_gamma.py OUTPUT [HEAD].

Left: the colour map is decoded, the picture encoded. Right: neither, the mistake of a renderer that knows no
gamma: colours too strong, shading that falls off too fast.
"""

import sys

import numpy as np

import dermis
from dermis.images.io import write_png

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
renderer = dermis.Renderer()
scene = dermis.Scene(head, camera=dermis.three_quarter(head))
pair = [
    renderer.draw(scene, dermis.Settings(size=(512, 512), atlas=1024, gamma=gamma)).srgb8()
    for gamma in ("right", "wrong")
]
write_png(sys.argv[1], np.hstack(pair))
