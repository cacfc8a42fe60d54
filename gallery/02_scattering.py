"""With and without light below the surface, from three sides: python gallery/02_scattering.py OUTPUT.

Left: the whole technique. Right: the same light, none of it scattered; shadows are hard, skin is dry.
"""

import sys

import numpy as np

import dermis

head = dermis.load_head("lee_perry_smith", subdivide=1)
renderer = dermis.Renderer()
rows = []
for camera in (dermis.portrait, dermis.three_quarter, dermis.profile):
    scene = dermis.Scene(head, camera=camera(head))
    pair = [renderer.render(scene, size=(640, 640), technique=name) for name in ("texture-space", "none")]
    rows.append(np.hstack(pair))
dermis.write_image(sys.argv[1], np.vstack(rows))
