"""Faces by melanin and blood.

The same head without a colour map, its colour from the profile alone: melanosomes in the epidermis across,
blood in the dermis down. Melanin absorbs mostly blue, blood mostly green.

Deck: S24
Sources: DonnerJensen2006
Columns: 4
"""

import tempfile
from pathlib import Path

import dermis
from dermis.apps.gallery.script import run_gallery_script
from dermis.optics.fits.gaussian import fit_gaussians
from dermis.optics.profiles import write_profile

MELANIN, BLOOD = (0.005, 0.04, 0.12, 0.32), (0.01, 0.025, 0.06)


def draw(studio):
    head = studio.head()
    camera = dermis.portrait(head).model_copy(update={"frame_mm": 300})
    panels = {}
    with tempfile.TemporaryDirectory() as folder:
        for blood in BLOOD:
            for melanin in MELANIN:
                file = Path(folder) / f"{melanin}-{blood}.toml"
                pigments = {"melanin": melanin, "blood": blood, "epidermis_mm": 0.1}
                tissue = dermis.load_tissue("spectral", pigments=pigments)
                write_profile(file, fit_gaussians(tissue.profile().ring_target(), 6).profile, {})
                skin = dermis.Skin(profile=str(file), albedo="profile")
                scene = dermis.Scene(head, camera=camera, skin=skin)
                panels[f"melanin {melanin:.1%}, blood {blood:.1%}"] = studio.render(scene, 0.6, exposure=1.4)
    return panels


if __name__ == "__main__":
    run_gallery_script(draw)
