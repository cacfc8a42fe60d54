"""One roughness for the face, and one for each region of it: python gallery/10_regions.py OUTPUT [HEAD].

Left: the same roughness everywhere. Middle: the package's values by region, an artist's; below each its
reflection alone, three times as bright. Right: those values, roughness from black 0.2 to white 0.4, strength
from 0 to 0.4 with what is fine in the scan's own map.
"""

import sys
from dataclasses import replace

import numpy as np

import dermis

SIZE = {"size": (448, 448), "atlas": 1024}

head = dermis.load_head(*(sys.argv[2:] or ["lee_perry_smith"]), subdivide=1)
regions, rho_s = dermis.with_regions(head)
oily, matt = dermis.Skin(rho_s=rho_s, oiliness=0.5), dermis.Skin(specular="none")
camera, even = dermis.portrait(head), dermis.Environment(name="uniform")
renderer = dermis.Renderer()


def lit(body: dermis.Head, colour: float | None = None, exposure: float = 1.0) -> np.ndarray:
    if colour is not None:
        body = replace(body, maps=replace(body.maps, colour=np.full((4, 4, 3), colour, np.float32)))
    return renderer.render(dermis.Scene(body, camera=camera, skin=oily), exposure=exposure, **SIZE)


def painted(levels: np.ndarray) -> np.ndarray:
    grey = np.clip(levels, 0, 1)[..., None].repeat(3, axis=2)
    body = replace(head, maps=replace(head.maps, colour=grey))
    scene = dermis.Scene(body, camera=camera, skin=matt, environment=even)
    return renderer.render(scene, technique="none", occlusion="none", **SIZE)


above = [lit(head), lit(regions), painted(5 * regions.maps.roughness - 1)]
below = [lit(head, 0, 3), lit(regions, 0, 3), painted(2.5 * regions.maps.specular)]
dermis.write_image(sys.argv[1], np.vstack([np.hstack(above), np.hstack(below)]))
