"""The head that the package makes, scattered above and dry below: python gallery/07_bust.py OUTPUT."""

import sys

import numpy as np

import dermis

head = dermis.load_head("bust")
renderer = dermis.Renderer()
cameras = (dermis.portrait(head), dermis.three_quarter(head), dermis.profile(head))
rows = []
for technique in ("texture-space", "none"):
    scenes = (dermis.Scene(head, camera=camera) for camera in cameras)
    rows.append(np.hstack([renderer.render(one, size=(512, 512), technique=technique) for one in scenes]))
dermis.write_image(sys.argv[1], np.vstack(rows))
