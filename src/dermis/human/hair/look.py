"""What a person's hairs are like."""

from __future__ import annotations

from typing import NamedTuple


class HairLook(NamedTuple):
    """Numbers by which people's brows and lashes differ.

    eumelanin, pheomelanin : concentrations, see `dermis.specular.hair.absorption_per_mm`
    bushy : of brows, from 0, sparse and short, to 1, dense and long
    grey : share of hairs without pigment
    seed : of what differs from hair to hair
    """

    eumelanin: float = 4.0
    pheomelanin: float = 0.3
    bushy: float = 0.4
    grey: float = 0.0
    seed: int = 0
