"""Light from all around, turned about the head: python gallery/12_environments.py OUTPUT [HEAD].

Above: a hall with many lamps. Below: a room with one large window. Each as it stands and turned by a third
and by two thirds; with the filmic tone curve.
"""

import sys

import numpy as np

import dermis
from dermis.images.io import write_png

EXPOSURES = {"royal_esplanade": 1.0, "lebombo": 1.0}

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
renderer = dermis.Renderer()
camera, skin = dermis.three_quarter(head), dermis.Skin(oiliness=0.3)
settings = dermis.Settings(size=(448, 448), atlas=1024, tone="filmic")
rows = []
for name, exposure in EXPOSURES.items():
    row = []
    for turn in (0, 120, 240):
        around = dermis.Environment(name=name, rotation_degrees=turn, exposure=exposure, visible=True)
        scene = dermis.Scene(head, camera=camera, skin=skin, environment=around)
        row.append(renderer.draw(scene, settings).srgb8())
    rows.append(np.hstack(row))
write_png(sys.argv[1], np.vstack(rows))
