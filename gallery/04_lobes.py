"""Five models of surface reflection.

The same skin with each model: on the head, alone (twice as bright), and in close-up. Phong and Blinn-Phong
reflect far too little at grazing angles.

Deck: S3, S4, S5
Equation: f_r = ρ_s D(m, N·H) F(V·H) / (4 (V·H)²) (Kelemen and Szirmay-Kalos)
Sources: Kelemen2001, TorranceSparrow1967, Phong1975, Blinn1977
Columns: 5
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.scene.camera import cheek

MODELS = ("phong", "blinn-phong", "torrance-sparrow", "kelemen", "two-lobe")
ALONE = {"parts": "specular", "exposure": 2.0}


def draw(studio):
    head = studio.head()
    near = dermis.portrait(head).model_copy(update={"frame_mm": 310})
    views = {"": (near, {}), ", alone": (near, ALONE), ", near": (cheek(head), {})}
    panels = {}
    for view, (camera, shown) in views.items():
        for model in MODELS:
            skin = dermis.Skin(specular=model)
            scene = dermis.Scene(head, camera=camera, skin=skin)
            panels[model + view] = studio.render(scene, 0.8, **shown)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
