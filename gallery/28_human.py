"""The human of the package.

The average person of MakeHuman's parametric human, which is part of the package: no scan, no file, no
network. With scattering above, without below: dry skin reflects as much light, but as a Lambertian surface.
The nose, without hair in front of a small lamp at the side, shows the difference best, at the edge of
the shadow.

Deck: S11
Columns: 3
"""

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script

NOSE_MM, OFFSET_MM, FRAME_MM = (0.0, -42.0, 25.0), (-150.0, -10.0, 500.0), 72.0


def draw(studio):
    head = studio.head("human")
    at = np.subtract(NOSE_MM, head.centre_mm)
    nose = dermis.Camera(position=tuple(at + OFFSET_MM), target=tuple(at), frame_mm=FRAME_MM)
    scenes = {
        "front": dermis.Scene(head, camera=dermis.portrait(head)),
        "three-quarter": dermis.Scene(head, camera=dermis.three_quarter(head)),
        "nose, raking light": dermis.Scene(head, camera=nose, lights="raking"),
    }
    panels = {}
    for technique, note in {"texture-space": "", "none": ", dry"}.items():
        for name, scene in scenes.items():
            strands = scene.camera is not nose
            panels[name + note] = studio.render(scene, technique=technique, strands=strands)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
