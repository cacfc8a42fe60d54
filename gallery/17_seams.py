"""What blurs do at the seams of the map: python gallery/17_seams.py OUTPUT.

Left to right: no remedy, the talk's four but the slow one (a colour around the charts, stretch from a map,
blurs that leave out what lies beside the charts), and blurs that go on across the seam. Above: the package's
bust from behind its left ear. Middle: the same head in 300 charts. Below: how far each is from the last,
4 times as bright.
"""

import sys

import numpy as np

import dermis

REMEDIES = ("none", "clear-colour", "stretch-map", "alpha", "stitch")

skin = dermis.Skin(profile="skin1", specular="none")
VIEWS = {
    "bust": (
        dermis.Camera(position=(900, -200, -500), target=(58, -52, -12), frame_mm=110),
        dermis.PointLight(position=(900, 420, 420)),
    ),
    "bust_many_charts": (
        dermis.Camera(position=(300, 0, 900), target=(24, -25, 70), frame_mm=110),
        dermis.PointLight(position=(-700, 400, 600)),
    ),
}

renderer = dermis.Renderer()
rows = []
for name, (camera, light) in VIEWS.items():
    scene = dermis.Scene(dermis.load_head(name), lights=[light], camera=camera, skin=skin)
    row = [renderer.render(scene, size=(288, 288), atlas=1024, seams=seams) for seams in REMEDIES]
    rows.append(np.hstack(row))
rows.append(4 * np.abs(rows[-1] - np.tile(row[-1], (1, len(row), 1))))
dermis.write_image(sys.argv[1], np.vstack(rows))
