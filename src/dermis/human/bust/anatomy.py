"""Where things are on the average head, and how large people are."""

from __future__ import annotations

import csv
from importlib import resources
from types import MappingProxyType

import numpy as np

# Places of the landmarks on the left half of the symmetric, average head [mm]: chosen so that the distances
# between them are near the published means; where there is none, an artist's value. The surface is modelled
# around them.
LANDMARKS = MappingProxyType(
    {
        "vertex": (0.0, 114.0, -8.0),
        "opisthocranion": (0.0, 30.0, -97.0),
        "glabella": (0.0, 20.0, 97.5),
        "nasion": (0.0, 4.5, 93.2),
        "nose tip": (0.0, -38.0, 115.5),
        "subnasale": (0.0, -49.5, 97.5),
        "upper lip": (0.0, -60.4, 97.8),
        "stomion": (0.0, -67.9, 97.0),
        "lower lip": (0.0, -77.8, 94.1),
        "pogonion": (0.0, -98.0, 92.8),
        "gnathion": (0.0, -111.5, 86.0),
        "eye": (31.7, 0.0, 70.5),
        "inner eye corner": (16.3, -3.6, 84.5),
        "outer eye corner": (44.7, -2.8, 75.9),
        "brow": (34.0, 22.0, 89.0),
        "nose wing": (16.4, -41.5, 95.0),
        "nostril": (6.7, -48.5, 100.0),
        "mouth corner": (26.0, -67.1, 85.7),
        "cheekbone": (47.0, -19.0, 74.4),
        "jaw angle": (52.0, -78.0, 8.0),
        "parietal": (74.0, 34.0, -24.0),
        "ear": (77.0, -12.0, -22.0),
        "ear lobe": (74.0, -37.0, -10.0),
    }
)
INSIDE = frozenset({"eye"})
"""Landmarks that are centres and do not lie on the skin."""


def published() -> dict[str, tuple[float, float]]:
    """Mean of men and of women by measure [mm]; sources [Gordon1989], [Farkas2005]."""
    text = resources.files(__package__).joinpath("anthropometry.csv").read_text("utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {row["measure"]: (float(row["male"]), float(row["female"])) for row in rows}


def nominal(name: str) -> np.ndarray:
    """The landmark (3,) on the average head [mm]."""
    return np.array(LANDMARKS[name])
