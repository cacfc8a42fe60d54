"""The six expressions that people everywhere know.

Weights of ARKit's targets move the skin; the folds that belong to a movement deepen with it, lips that are
pressed turn pale, and the eyes turn with the lids. Shape, shadows and what scatters below the skin follow.

Deck: +
Columns: 3
Sources: Ekman1971
"""

import dermis
from dermis.apps.gallery.picture import main

WOMAN = dermis.Human(caucasian=0.5, african=0, asian=0.5, age=40)


def both(**weights):
    return {f"{name}{side}": weight for name, weight in weights.items() for side in ("Left", "Right")}


FACES = {
    "joy": both(mouthSmile=0.9, cheekSquint=0.8, eyeSquint=0.4),
    "sadness": both(mouthFrown=0.8, browOuterUp=0.0, eyeLookDown=0.5)
    | {"browInnerUp": 1.0, "mouthShrugLower": 0.4},
    "anger": both(browDown=1.0, noseSneer=0.4, mouthPress=0.8, eyeSquint=0.5),
    "fear": both(eyeWide=0.9, browOuterUp=0.5, mouthStretch=0.7) | {"browInnerUp": 0.9, "jawOpen": 0.12},
    "disgust": both(noseSneer=1.0, browDown=0.6, mouthUpperUp=0.7, eyeSquint=0.5),
    "surprise": both(eyeWide=0.8, browOuterUp=1.0) | {"browInnerUp": 1.0, "jawOpen": 0.45},
}


def draw(studio):
    head = WOMAN.head(subdivide=2)
    camera = dermis.Camera(position=(0, 10, 1200), target=(0, 10, 0), frame_mm=250)
    return {name: studio.render(dermis.Scene(head, pose=pose, camera=camera)) for name, pose in FACES.items()}


if __name__ == "__main__":
    main(draw)
