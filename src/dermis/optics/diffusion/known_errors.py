"""How far diffusion models are from photons, as far as that was measured."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from dermis.base.tables import numbers, read_rows
from dermis.optics.media import Floats
from dermis.optics.radial import RadialProfile


@dataclass(frozen=True)
class ModelError:
    """Error of a model in the light that leaves through rings, against photons [-].

    least, most : (3,) for red, green and blue; the same where it was measured on the tissue itself
    tissues : what it was measured on
    """

    least: Floats
    most: Floats
    tissues: tuple[str, ...]


def known_error(model: str, tissue: str = "") -> ModelError | None:
    """The error of a model on a tissue, or over all that it was measured on; None for one that never was.

    tissue : its name, empty for any
    """
    found = {name: error for (name, of), error in _table().items() if of == model}
    if tissue in found:
        found = {tissue: found[tissue]}
    if not found:
        return None
    errors = np.array(list(found.values()))
    return ModelError(errors.min(axis=0), errors.max(axis=0), tuple(found))


def counted_error(radial: RadialProfile, photons: RadialProfile) -> ModelError:
    """The error of a profile by photons counted for it."""
    miss = ((radial.ring_energy - photons.ring_energy) ** 2).sum(axis=0)
    error = np.sqrt(miss / (photons.ring_energy**2).sum(axis=0))
    return ModelError(error, error, (radial.name,))


@cache
def _table() -> dict[tuple[str, str], Floats]:
    rows = read_rows("dermis.optics.data", "model_errors")
    errors = numbers(rows, "red green blue")
    return {(row["tissue"], row["model"]): error for row, error in zip(rows, errors, strict=True)}
