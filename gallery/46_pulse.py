"""A heartbeat in the colour of the face, magnified 30 times.

Six phases of a beat: the mean of the six pictures, plus 30 times the difference of each from this mean.

Deck: S24
Columns: 6
Sources: DonnerJensen2006, Jacques1998
"""

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script

PHASES, GAIN = 6, 30.0


def draw(studio):
    head = dermis.Human(hair=dermis.HairLook("cropped")).head()
    pulse = dermis.Pulse(rate_per_min=60, head_motion_mm=0)
    scene = dermis.Scene(head, lights="studio", camera=dermis.headshot(head))
    beat = [studio.render_linear(pulse.scene_at(scene, k / PHASES), scale=0.5) for k in range(PHASES)]
    mean = np.mean(beat, axis=0)
    return {f"{k}/{PHASES} of a beat": mean + GAIN * (picture - mean) for k, picture in enumerate(beat)}


if __name__ == "__main__":
    run_gallery_script(draw)
