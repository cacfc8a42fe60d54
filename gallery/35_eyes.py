"""Procedural eyes.

The fibres of the iris scatter blue light; eumelanin above them makes it green or brown. The cornea refracts
the view, so that the iris bulges when seen from the side.

Deck: +
Columns: 4
"""

from dataclasses import replace

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.mesh.eye_look import EyeLook

BESIDE = (-0.75, 0.1, 1.0)
EYES = {
    "no pigment": (EyeLook(0.03, seed=4), (0, 0, 1)),
    "a little": (EyeLook(0.3, 2.4, seed=7), (0, 0, 1)),
    "much": (EyeLook(0.75, 1.5, seed=2), (0, 0, 1)),
    "from the side": (EyeLook(0.15, 1.6, seed=9), BESIDE),
}


def draw(studio):
    head = dermis.Human(caucasian=1, african=0, asian=0).head(subdivide=2)
    eye = np.array([-28.5, -1.0, 12.0]) - head.centre_mm
    panels = {}
    for name, (look, axis) in EYES.items():
        camera = dermis.Camera(position=tuple(eye + 500 * np.array(axis)), target=tuple(eye), frame_mm=36)
        own = dermis.Scene(replace(head, eyes=head.eyes.with_look(look)), camera=camera)
        panels[name] = studio.render(own)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
