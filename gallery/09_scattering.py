"""With and without subsurface scattering.

The same lights on the same skin. Without scattering, shadows are hard and grey, and skin looks dry.

Deck: S11
Sources: dEonLuebke2007
Slider: dry and hard | scattered
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    head = studio.head()
    key = dermis.PointLight(position=(-620, 420, 620), irradiance=(3.4, 3.3, 3.1))
    fill = dermis.RectangleLight(position=(800, 100, 700), irradiance=(0.25, 0.27, 0.3))
    camera = dermis.portrait(head).model_copy(update={"target": (10.0, -15.0, 60.0), "frame_mm": 170})
    scene = dermis.Scene(head, lights=[key, fill], camera=camera)
    return {
        "dry and hard": studio.render(scene, 1.6, technique="none"),
        "scattered": studio.render(scene, 1.6),
    }


if __name__ == "__main__":
    run_gallery_script(draw)
