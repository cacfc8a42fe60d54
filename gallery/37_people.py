"""Three random people.

Drawn at random from numbers: shape, pigments, pores, folds that follow the face, eyes, hair and lashes.
Everything is part of the package; nothing is a photograph.

Deck: +
Columns: 3
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.scene.gaze import looking_at

PEOPLE = {
    7: dermis.Pose(bones={"neck03": (0, 8, 2), "head": (0, 8, 0)}),
    10: dermis.Pose(bones={"neck03": (0, 3, -2)}),
    16: dermis.Pose(bones={"neck03": (0, -8, -2), "head": (2, -8, 0)}),
}


def draw(studio):
    panels = {}
    for seed, pose in PEOPLE.items():
        head = dermis.Human.sampled(seed).head(subdivide=2)
        camera = dermis.Camera(position=(0, 0, 1100), target=(0, 5, 0), frame_mm=290)
        scene = dermis.Scene(head, pose=looking_at(head, camera.position, pose), camera=camera)
        settings = {"atlas": 2048, "background": "gradient", "exposure": "auto", "samples": 16}
        panels[f"human:{seed}"] = studio.render(scene, **settings)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
