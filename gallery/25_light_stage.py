"""A light stage: relighting by adding pictures.

The head under 48 surrounding lights, one at a time, as a light stage photographs it. Any environment is then
a weighted sum of these pictures, without rendering. Beside it the same room rendered directly.

Deck: S24
Equation: L = Σ_i E_i L_i
Sources: Debevec2000
"""

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.scene.light_stage import light_stage, light_stage_weights

ROOM = dermis.Environment(name="lebombo")


def draw(studio):
    head = studio.head()
    camera, lights = dermis.three_quarter(head), light_stage(48)
    stage = [studio.render_linear(dermis.Scene(head, lights=[light], camera=camera), 0.7) for light in lights]
    relit = np.einsum("lc,lyxc->yxc", light_stage_weights(lights, ROOM), stage)
    room = dermis.Scene(head, camera=camera, environment=ROOM)
    return {
        "one light after the other": [3 * picture for picture in stage],
        "48 pictures, added up": np.float32(relit),
        "rendered at once": studio.render_linear(room, 0.7),
    }


if __name__ == "__main__":
    run_gallery_script(draw)
