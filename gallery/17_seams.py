"""What blurs do at the seams of the map: python gallery/17_seams.py OUTPUT [HEAD].

Left to right: no remedy, the talk's but the slow one (a colour around the charts, blurs that narrow at their
edges, blurs that leave out what lies beside them), and blurs that go on across the seam. Above the package's
bust from behind its left ear, then the same head in 300 charts (HEAD: one of the two); below each how far it
is from the last, 4 times as bright.
"""

import sys

import numpy as np

import dermis

REMEDIES = ("none", "clear-colour", "stretch-map", "alpha", "stitch")
VIEWS = {
    "bust": (
        dermis.Camera(position=(900, -200, -500), target=(52, -62, -28), frame_mm=105),
        dermis.PointLight(position=(900, 420, 420), irradiance=(4, 4, 4)),
    ),
    "bust_many_charts": (
        dermis.Camera(position=(300, 0, 900), target=(12, -22, 70), frame_mm=115),
        dermis.PointLight(position=(-520, 380, 760), irradiance=(4, 4, 4)),
    ),
}

renderer = dermis.Renderer()
skin = dermis.Skin(profile="skin1", specular="none")
rows = []
for name in sys.argv[2:] or VIEWS:
    camera, light = VIEWS[name]
    scene = dermis.Scene(dermis.load_head(name), lights=[light], camera=camera, skin=skin)
    row = [renderer.render(scene, size=(256, 256), atlas=1024, seams=seams) for seams in REMEDIES]
    rows += [np.hstack(row), np.hstack([4 * np.abs(one - row[-1]) for one in row])]
dermis.write_image(sys.argv[1], np.vstack(rows))
