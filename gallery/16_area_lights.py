"""Shadows of a point, a sphere and a rectangle in one place: python gallery/16_area_lights.py OUTPUT [HEAD].

The larger the light, the softer what it casts; yet every shadow is sharp where it begins, below the wing of
the nose and between the lips, and goes soft with distance. A weak light from the other side fills the rest.
"""

import sys

import numpy as np

import dermis

PLACE = {"position": (-520.0, 760.0, 760.0), "irradiance": (3.3, 3.1, 2.8)}
FILL = dermis.RectangleLight(position=(900, 0, 900), irradiance=(0.3, 0.3, 0.32), width_mm=300, height_mm=300)
LIGHTS = (
    dermis.PointLight(**PLACE),
    dermis.SphereLight(**PLACE, radius_mm=100),
    dermis.RectangleLight(**PLACE, width_mm=400, height_mm=400),
)

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
renderer = dermis.Renderer()
near = dermis.portrait(head).model_copy(update={"target": (22.0, -32.0, 90.0), "frame_mm": 100.0})
rows = []
for camera in (dermis.portrait(head), near):
    scenes = [dermis.Scene(head, lights=[light, FILL], camera=camera) for light in LIGHTS]
    rows.append(np.hstack([renderer.render(scene, size=(448, 448), atlas=1024) for scene in scenes]))
dermis.write_image(sys.argv[1], np.vstack(rows))
