"""The colour map before the blur, after it, or half and half.

Multiplied before the blur, the map loses its detail; after it, no colour bleeds. With a mix of one half, the
square root of the map is applied on both sides.

Deck: S20
Equation: E′ = E albedo^mix, L = (E′ ∗ R) albedo^(1−mix)
Sources: dEonLuebke2007
Columns: 3
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.scene.camera import cheek

MIXES = {"after (mix 0)": 0.0, "half and half (0.5)": 0.5, "before (1)": 1.0}


def draw(studio):
    head = studio.head()
    views = {"": dermis.portrait(head).model_copy(update={"frame_mm": 290}), ", near": cheek(head)}
    panels = {}
    for view, camera in views.items():
        for label, mix in MIXES.items():
            skin = dermis.Skin(mix=mix, specular="none")
            panels[label + view] = studio.render(dermis.Scene(head, camera=camera, skin=skin), atlas=2048)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
