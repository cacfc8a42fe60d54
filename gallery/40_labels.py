"""Ground truth of a face.

Landmarks, green where visible and red where hidden, and the parts of the face: known to the renderer, not
estimated from the picture. Left and right are those of the person.

Deck: +
Columns: 3
"""

import dermis
from dermis.apps.gallery.panels import draw_landmarks, output_image
from dermis.apps.gallery.script import run_gallery_script

SET = "face-synthetics-70"
PEOPLE = {
    1: dermis.Pose({"eyeBlinkLeft": 1.0}),
    4: dermis.Pose({"jawOpen": 0.6}, {"head": (0, 20, 0)}),
    6: dermis.Pose(bones={"neck03": (0, -20, 0), "head": (0, -30, 0)}),
}


def draw(studio):
    camera = dermis.Camera(position=(0, 0, 1100), target=(0, -6, 0), frame_mm=250)
    scenes = [dermis.Scene(f"human:{seed}", camera=camera, pose=pose) for seed, pose in PEOPLE.items()]
    settings = studio.settings(exposure=1.5)
    observations = list(studio.renderer.observe(scenes, settings, outputs=("label",), landmarks=(SET,)))
    named = {f"human:{seed}": one for seed, one in zip(PEOPLE, observations, strict=True)}
    panels = {name: draw_landmarks(one.picture, one.landmarks[SET]) for name, one in named.items()}
    labels = {f"{name}, label": output_image("label", one.outputs["label"]) for name, one in named.items()}
    return panels | labels


if __name__ == "__main__":
    run_gallery_script(draw)
