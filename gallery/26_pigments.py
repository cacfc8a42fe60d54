"""Skin by its pigments, melanin across and blood down.

Each patch is the colour of two-layered skin under daylight, without surface reflection.

Deck: S24
Sources: DonnerJensen2006, KrishnaswamyBaranoski2004, Jacques1998
"""

import numpy as np

import dermis
from dermis.apps.gallery.panels import plot_panel
from dermis.apps.gallery.script import run_gallery_script
from dermis.images.colour import encode_srgb8

MELANIN = [0.0, 0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32]
BLOOD = [0.002, 0.005, 0.01, 0.02, 0.035, 0.06]


def colour(melanin, blood):
    pigments = {"melanin": melanin, "blood": blood, "epidermis_mm": 0.1}
    return dermis.load_tissue("spectral", pigments=pigments).profile().total


def patches(axes):
    colours = np.array([[colour(melanin, blood) for melanin in MELANIN] for blood in BLOOD])
    axes.imshow(encode_srgb8(np.maximum(colours, 0.0).astype(np.float32)), aspect="auto")
    axes.set(xlabel="melanosomes in the epidermis", ylabel="blood in the dermis")
    axes.set_xticks(range(len(MELANIN)), [f"{share:.1%}" for share in MELANIN], rotation=45)
    axes.set_yticks(range(len(BLOOD)), [f"{share:.1%}" for share in BLOOD])
    axes.tick_params(length=0)


def draw(studio):
    return {"": plot_panel(patches, 2 * studio.side)}


if __name__ == "__main__":
    run_gallery_script(draw)
