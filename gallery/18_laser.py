"""A laser line on cheek and ear.

A vertical sheet of light shows how far light spreads in curved skin: without scattering, with the scattering
of this package, and path traced through the medium as the reference.

Deck: S19
Sources: Dudash2007, JensenBuhler2002, Jakob2022
"""

from importlib.util import find_spec

import numpy as np

from dermis.apps.gallery.script import run_gallery_script
from dermis.apps.validation.comparisons.compare import compare


def draw(studio):
    against = "path-traced" if find_spec("mitsuba") else "surface-integral"
    settings = studio.settings(0.8, atlas=2048)
    techniques = ("none", "texture-space")
    comparison = compare(studio.head(), against, techniques, light="laser", region="ear", settings=settings)
    shown = {"dry": comparison.images["none"], "texture space": comparison.images["texture-space"]}
    shown |= {f"truth ({against})": comparison.reference.image}
    return {label: np.float32(3 * comparison.exposure * image) for label, image in shown.items()}


if __name__ == "__main__":
    run_gallery_script(draw)
