"""The cheek from close by, with and without scattering: python gallery/03_pores.py OUTPUT.

Pores come from the 4096 x 4096 height map; they stay sharp in the reflection and soften in what scattered.
"""

import sys

import numpy as np

import dermis
from dermis.scene.camera import cheek

head = dermis.load_head("lee_perry_smith", subdivide=1)
renderer = dermis.Renderer()
scene = dermis.Scene(head, camera=cheek(head))
pair = [renderer.render(scene, size=(800, 800), technique=name) for name in ("texture-space", "none")]
dermis.write_image(sys.argv[1], np.hstack(pair))
