"""Skin by its pigments, melanin across and blood down: python gallery/05_skin_colours.py OUTPUT.

Each patch is the light that leaves a two-layer skin under daylight, without the reflection of its surface.
"""

import sys

import numpy as np
from matplotlib.figure import Figure

import dermis
from dermis.images.colour import encode_srgb8
from dermis.optics.pigments.spectra import outside_gamut

MELANIN = [0.0, 0.005, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32]
BLOOD = [0.002, 0.005, 0.01, 0.02, 0.035, 0.06]


def colour(melanin: float, blood: float) -> np.ndarray:
    skin = dermis.load_tissue("spectral", pigments={"melanin": melanin, "blood": blood, "epidermis_mm": 0.1})
    return skin.profile().total


sheet = np.array([[colour(melanin, blood) for melanin in MELANIN] for blood in BLOOD])
if outside_gamut(sheet).any():
    sys.stderr.write(f"{outside_gamut(sheet).sum()} patches lie outside Rec. 709\n")
figure = Figure(figsize=(8, 5.4), dpi=110, layout="constrained")
axes = figure.subplots()
axes.imshow(encode_srgb8(np.maximum(sheet, 0.0).astype(np.float32)), aspect="auto")
axes.set(xlabel="melanosomes in the epidermis", ylabel="blood in the dermis")
axes.set_xticks(range(len(MELANIN)), [f"{share:.1%}" for share in MELANIN])
axes.set_yticks(range(len(BLOOD)), [f"{share:.1%}" for share in BLOOD])
axes.tick_params(length=0)
axes.spines[:].set_visible(False)
figure.savefig(sys.argv[1])
