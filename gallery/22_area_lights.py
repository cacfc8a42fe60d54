"""Shadows of a point, a sphere and a rectangle at the same position.

The larger the light, the softer its shadows; yet every shadow is sharp at contact, below the wing of the nose
and between the lips, and softens with distance.

Deck: S7
Sources: Fernando2005
Columns: 3
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

PLACE = {"position": (-520.0, 760.0, 760.0), "irradiance": (3.3, 3.1, 2.8)}
FILL = dermis.RectangleLight(position=(900, 0, 900), irradiance=(0.3, 0.3, 0.32), width_mm=300, height_mm=300)
LIGHTS = {
    "point": dermis.PointLight(**PLACE),
    "sphere of 100 mm": dermis.SphereLight(**PLACE, radius_mm=100),
    "rectangle of 400 mm": dermis.RectangleLight(**PLACE, width_mm=400, height_mm=400),
}


def draw(studio):
    head = studio.head()
    near = dermis.portrait(head).model_copy(update={"target": (22.0, -32.0, 90.0), "frame_mm": 100.0})
    panels = {}
    for view, camera in {"": dermis.portrait(head), ", near": near}.items():
        for name, light in LIGHTS.items():
            panels[name + view] = studio.render(dermis.Scene(head, lights=[light, FILL], camera=camera))
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
