"""A turntable, frame by frame.

Camera and lights move freely: only what changed is computed again.

Deck: S25
Sources: dEonLuebke2007
"""

import math

import dermis
from dermis.apps.gallery.script import run_gallery_script

FRAMES = 36


def draw(studio):
    head = studio.head()
    film = []
    for frame in range(FRAMES):
        angle = 2 * math.pi * frame / FRAMES
        position = (1200 * math.sin(angle), 20.0, 1200 * math.cos(angle))
        camera = dermis.portrait(head).model_copy(update={"position": position})
        film.append(studio.render(dermis.Scene(head, camera=camera), 0.8, samples=4))
    return {f"{FRAMES} frames": film}


if __name__ == "__main__":
    run_gallery_script(draw)
