"""The human of the package.

The average person of MakeHuman's parametric human, which is part of the package: no scan, no file, no
network. With scattering above, without below.

Deck: S11
Columns: 3
"""

import dermis
from dermis.apps.gallery.script import run_gallery_script


def draw(studio):
    head = studio.head("human")
    views = {"front": dermis.portrait, "three-quarter": dermis.three_quarter, "side": dermis.side}
    panels = {}
    for technique, note in {"texture-space": "", "none": ", dry"}.items():
        for name, camera in views.items():
            scene = dermis.Scene(head, camera=camera(head))
            panels[name + note] = studio.render(scene, technique=technique)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
