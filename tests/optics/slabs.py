"""Media that several tests use, and their supplied reference results."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dermis.optics.media import Floats, Layer, Medium, published_media

TWO_LAYER = Medium(
    "two_layer",
    (Layer(np.array([0.5]), np.array([4.0]), 0.5), Layer(np.array([0.05]), np.array([1.0]))),
)


def slab(alpha_prime: float, thickness_mm: float = np.inf, eta: float = 1.4) -> Medium:
    """Return a homogeneous slab with a mean free path of 1 mm."""
    layer = Layer(np.array([1.0 - alpha_prime]), np.array([alpha_prime]), thickness_mm)
    return Medium(f"slab {alpha_prime:g}", (layer,), eta)


def case(name: str) -> Medium:
    """Return the one-channel medium of a row of the reference tables."""
    if name.startswith("two_layer"):
        return TWO_LAYER
    medium = published_media()[name[:-2]]
    return medium.channel("RGB".index(name[-1])).with_eta(1.3 if name.startswith("skin1") else 1.4)


def table(folder: Path, name: str) -> Any:
    """Return a CSV file of the reference folder by column."""
    path = folder / "reference" / "data" / name
    return np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")


def ring_means(edges_mm: Floats, energy: Floats) -> Floats:
    """Return the mean of R(r) over each ring [1/mm2]."""
    area = np.pi * np.diff(edges_mm**2)
    return np.asarray(energy / area[:, None])
