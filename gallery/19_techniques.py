"""Six ways to scatter light, at the shadow of the nose: python gallery/19_techniques.py OUTPUT [HEAD].

Above: none at all, one blur for all colours, the passes of 2007. Below: those of this package, and what
engines do: blurs over the picture, and tables over curvature.
"""

import sys

import numpy as np

import dermis

TECHNIQUES = (
    ("none", "one-blur", "published"),
    ("texture-space", "screen-space", "pre-integrated"),
)

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
key = dermis.PointLight(position=(-620, 420, 620), irradiance=(3.4, 3.3, 3.1))
near = dermis.portrait(head).model_copy(update={"target": (14.0, -28.0, 90.0), "frame_mm": 90.0})
scene = dermis.Scene(head, lights=[key], camera=near, skin=dermis.Skin(profile="skin1", specular="none"))
renderer = dermis.Renderer()
rows = [
    np.hstack([renderer.render(scene, size=(256, 256), atlas=1024, technique=name) for name in row])
    for row in TECHNIQUES
]
dermis.write_image(sys.argv[1], np.vstack(rows))
