"""One roughness for the face, or one per region.

Roughness and strength by region, and one value everywhere; beside each its reflection alone, three times as
bright. Below, both maps in grey: roughness 0.2 to 0.4, strength 0 to 1.2. The values are an artist's choice.

Deck: S9, S10
Sources: Weyrich2006
Columns: 2
"""

from dataclasses import replace

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script

ALONE = {"parts": "specular", "exposure": 3}


def draw(studio):
    head = studio.head(regions="none")
    regions, rho_s = dermis.with_regions(head)
    skin, camera = dermis.Skin(rho_s=rho_s), dermis.portrait(head)
    panels = {}
    for name, body in {"by region": regions, "constant": head}.items():
        scene = dermis.Scene(body, camera=camera, skin=skin)
        panels |= {name: studio.render(scene), f"{name}, alone": studio.render(scene, **ALONE)}
    greys = {"roughness": 5 * regions.maps.roughness - 1, "strength": regions.maps.specular / 1.2}
    even, matt = dermis.Environment(name="uniform"), dermis.Skin(specular="none")
    for name, grey in greys.items():
        colour = np.float32(np.clip(grey, 0, 1))[..., None].repeat(3, axis=2)
        painted = replace(head, maps=replace(head.maps, colour=colour))
        scene = dermis.Scene(painted, (), camera, matt, even)
        panels[name] = studio.render(scene, technique="none", occlusion="none")
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
