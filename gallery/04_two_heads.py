"""Two skins that meet a hard seam at the neck: python gallery/04_two_heads.py OUTPUT MAKEHUMAN_FOLDER.

The folder holds two heads cut from the MakeHuman base mesh (CC0), in decimetres, with their colour maps.
"""

import sys
from pathlib import Path

import numpy as np

import dermis

folder = Path(sys.argv[2])
heads = {
    "head_young_male_light.obj": "young_lightskinned_male_diffuse.png",
    "head_old_male_dark.obj": "old_darkskinned_male_diffuse.png",
}
renderer = dermis.Renderer()
rows = []
for mesh, colour in heads.items():
    head = dermis.load_head(folder / mesh, unit_mm=100, colour=folder / "skins" / colour, subdivide=1)
    scene = dermis.Scene(head, camera=dermis.three_quarter(head))
    pair = [renderer.render(scene, size=(640, 640), technique=name) for name in ("texture-space", "none")]
    rows.append(np.hstack(pair))
dermis.write_image(sys.argv[1], np.vstack(rows))
