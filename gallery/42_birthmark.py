"""A birthmark that scatters less.

Lines of light across a port-wine stain remain narrow except for their red, as blood absorbs other colours.

Sources: DonnerJensen2006, dEonLuebke2007
"""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.apps.inverse.unmixing.profile_widths import profile_mixture, save_mixture


def draw(studio):
    head = studio.head_with_colour_map()
    pigments, positions = dermis.unmix(head.maps.colour, adapter=studio.adapter), head.mesh.positions
    u, v = head.mesh.uv[np.linalg.norm(positions - head.centre_mm - (36, -22, 75), axis=1).argmin()]
    y, x = (np.linspace(0.0, 1.0, side) for side in pigments.blood.shape)
    mark = 1.0 / (1.0 + np.exp((np.hypot(x - u, y[:, None] - v) - 0.04) / 0.002))
    marked = replace(pigments, blood=np.float32(pigments.blood * (1.0 + 9.0 * mark)))
    colour = marked.recoloured(adapter=studio.adapter).clip(0.0, 1.0)
    stripe = {"direction": (-0.2, 0, -1), "up": (1, 0, 0), "width_mm": 0.8, "irradiance": (4, 4, 4)}
    lights = [dermis.StripeLight(position=(0, height, 0), **stripe) for height in (-47, -35, -23, -11)]
    lights += [dermis.RectangleLight(position=(300, 300, 700), irradiance=(0.7, 0.7, 0.7))]
    camera = dermis.portrait(head).model_copy(update={"target": (36, -24, 60), "frame_mm": 55})
    scene = dermis.Scene(replace(head, maps=replace(head.maps, colour=colour)), lights=lights, camera=camera)
    with TemporaryDirectory() as folder:
        first, *others, weights = map(str, save_mixture(Path(folder), profile_mixture(marked)))
        one = dermis.Skin(profile=first, specular="none")
        skins = {"one profile": one, "by maps": one.replace(other_profiles=others, profile_map=weights)}
        return {name: studio.render(replace(scene, skin=skin), 1.4) for name, skin in skins.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
