"""Ears lit from behind: python gallery/18_thin_parts.py OUTPUT [HEAD].

Above: the scan's left ear. Below: the bust's. Left: skin taken for thick everywhere. Right: with the light
that comes through; it is red, for red light reaches deepest, and strongest where the ear is thinnest.
"""

import sys

import numpy as np

import dermis

HEADS = (*(sys.argv[2:] or ["lee_perry_smith"]), "bust")

renderer = dermis.Renderer()
rows = []
for name in HEADS:
    head = dermis.load_head(name)
    places = head.mesh.positions - head.centre_mm
    upper = places[np.abs(places[:, 1]) < 60]
    x, y, z = (float(part) for part in upper[upper[:, 0].argmax()])
    lamp = dermis.PointLight(position=(x + 150, y + 60, z - 600), target=(x, y, z), irradiance=(9, 9, 9))
    fill = dermis.RectangleLight(position=(600, 200, 700), irradiance=(0.35, 0.37, 0.4))
    camera = dermis.Camera(position=(x + 420, y + 20, z + 420), target=(x - 12, y, z), frame_mm=110)
    scene = dermis.Scene(head, lights=[lamp, fill], camera=camera, skin=dermis.Skin(profile="skin1"))
    pair = [renderer.render(scene, size=(448, 448), transmission=through) for through in ("none", "thin")]
    rows.append(np.hstack(pair))
dermis.write_image(sys.argv[1], np.vstack(rows))
