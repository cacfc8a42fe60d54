"""A close-up of 48 mm of cheek.

Pores stay sharp in the surface reflection and soften in the scattered light.

Deck: S1, S11
Sources: dEonLuebke2007
Slider: dry | scattered
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.scene.camera import cheek


def draw(studio):
    head = studio.head()
    scene = dermis.Scene(head, camera=cheek(head))
    return {
        "dry": studio.render(scene, 1.6, technique="none"),
        "scattered": studio.render(scene, 1.6, atlas=2048),
    }


if __name__ == "__main__":
    run_gallery_script(draw)
