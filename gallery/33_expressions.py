"""The six universal expressions.

Weights of ARKit's morph targets move the skin; folds deepen with the movement, pressed lips turn pale, and
the eyes turn with the lids. Shape, shadows and subsurface scattering follow.

Deck: +
Columns: 3
Sources: Ekman1971
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.human.expressions import expression

WOMAN = dermis.Human(caucasian=0.5, african=0, asian=0.5, age=40, hair=dermis.HairLook("bun"))
NAMES = "joy", "plain-sadness", "plain-anger", "plain-fear", "plain-disgust", "plain-surprise"


def draw(studio):
    head = WOMAN.head(subdivide=2)
    camera = dermis.Camera(position=(0, 10, 1200), target=(0, 10, 0), frame_mm=250)
    faces = {name.removeprefix("plain-"): expression(name) for name in NAMES}
    return {name: studio.render(dermis.Scene(head, pose=pose, camera=camera)) for name, pose in faces.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
