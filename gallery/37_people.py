"""Three random people.

Drawn at random and painted from numbers: pigments, pores, folds that follow the face, eyes, brows and lashes.
Everything is part of the package; nothing is a photograph.

Deck: +
Columns: 3
"""

import dermis
from dermis.apps.gallery.script import draw_script
from dermis.human.expressions import expression
from dermis.scene.gaze import looking_at

PEOPLE = {
    4: dermis.Pose(bones={"neck03": (0, 8, 2), "head": (0, 8, 0)}),
    14: dermis.Pose(expression("faint-smile"), {"neck03": (0, 3, -2)}),
    18: dermis.Pose(bones={"neck03": (0, -8, -2), "head": (2, -8, 0)}),
}


def draw(studio):
    panels = {}
    for seed, pose in PEOPLE.items():
        head = dermis.Human.drawn(seed).head(subdivide=2)
        camera = dermis.Camera(position=(0, 0, 1100), target=(0, -6, 0), frame_mm=280)
        scene = dermis.Scene(head, pose=looking_at(head, camera.position, pose), camera=camera)
        panels[f"human:{seed}"] = studio.render(scene, atlas=2048, exposure=1.5, samples=16)
    return panels


if __name__ == "__main__":
    draw_script(draw)
