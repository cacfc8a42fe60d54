"""A cascade of Gaussians, each blurred from the previous one.

Six widths from 0.08 to 2.7 mm. Wide blurs start from narrow ones and add the difference of the variances, at
lower and lower resolution. Weighted by colour they add up to skin; the narrowest is finer than the atlas, so
each pixel is lit directly instead.

Deck: S15, S16, S21
Equation: E_k = E_{k−1} ∗ G(v_k − v_{k−1})
Sources: dEonLuebke2007, BurtAdelson1983
Columns: 4
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script

VIEWS = ("irradiance", "blur 1", "blur 2", "blur 3", "blur 4", "blur 5", "diffuse", "picture")


def draw(studio):
    head = studio.head()
    key = dermis.PointLight(position=(-620, 420, 620), irradiance=(3.4, 3.3, 3.1))
    near = dermis.portrait(head).model_copy(update={"target": (14.0, -28.0, 90.0), "frame_mm": 120.0})
    scene = dermis.Scene(head, lights=[key], camera=near)
    return {view: studio.render_view(scene, view) for view in VIEWS}


if __name__ == "__main__":
    run_gallery_script(draw)
