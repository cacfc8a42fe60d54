"""Outputs of a frame besides its colour.

Depth, normals, motion since the previous frame, light before and after scattering, pigments and labels, all
sampled at the pixel centres, so that they agree. Hair is rendered over them.

Deck: +
Columns: 7
"""

import dermis
from dermis.apps.gallery.panels import output_image
from dermis.apps.gallery.script import run_gallery_script
from dermis.scene.outputs import OUTPUTS

NAMES = [name for name in OUTPUTS if name not in ("normal_geometric", "label_face_synthetics")]
BEFORE = dermis.Pose(bones={"head": (0, 12, 0)})
SUN = dermis.DirectionalLight(direction=(0.75, -0.1, 0.65), irradiance=(6.0, 5.2, 4.2))  # from behind
NOW = dermis.Pose({"jawOpen": 0.3}, bones={"head": (3, 18, 0)})


def draw(studio):
    camera = dermis.Camera(position=(-250, 10, 1050), frame_mm=270)
    before = dermis.Scene("human:7", (*dermis.studio(), SUN), camera, pose=BEFORE)
    now, settings = before.replace(pose=NOW), studio.settings()
    rendered = studio.renderer.draw(now, settings, outputs=NAMES, previous=before)
    return {"picture": rendered.srgb8()} | {name: output_image(name, rendered.output(name)) for name in NAMES}


if __name__ == "__main__":
    run_gallery_script(draw)
