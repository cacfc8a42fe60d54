"""Diffusion through a stack with fluence and flux continuous at each interface.

In the Hankel domain each layer obeys D phi'' - D q^2 phi = -S(z). From the bottom up the recursion carries
the boundary condition that all layers below impose: D phi' = W - Z phi at the lower face.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats, Layer, Medium

Source = Literal["beam", "point"]


class _Sheet(NamedTuple):
    """A layer, or the part of one above or below a point source."""

    layer: Layer
    thickness_mm: float | Floats
    beam: Floats  # what is left of the light where the sheet begins
    point: Floats  # power of a point source on its lower face


class _Face(NamedTuple):
    Z: Floats
    W: Floats


class _Passage(NamedTuple):
    """What carries the fluence from a sheet's upper to its lower face; all 0 below which nothing is."""

    E: Floats | float = 0.0
    rho: Floats | float = 0.0
    common: Floats | float = 0.0
    beta: Floats | float = 0.0
    lower: Floats | float = 0.0

    def down(self, fluence: Floats) -> Floats:
        across = self.E * (1.0 + self.rho) * self.common
        return np.asarray(fluence * across + (self.beta * (1.0 - self.E * across) + self.lower))


def respond(frequency: ArrayLike, medium: Medium, A: float, source: Source = "beam") -> tuple[Floats, Floats]:
    """Hankel transforms of R(r) and T(r) per power that entered, (n, c) each, by frequency s > 0 [-].

    A : boundary mismatch against the air; inner faces are index-matched [-]
    source : "beam" has light scatter first all along the beam: R(r) grows like a logarithm at its centre;
        "point" puts it all one mean free path deep: R(r) is finite

    Source: [Haskell1994] for the boundary, [Kienle1998] for layers, [Farrell1992] for the beam.
    """
    return _respond(frequency, _sheets(medium, source), medium.channels, A)


def reflect(frequency: ArrayLike, medium: Medium, A: float, source: Source = "beam") -> Floats:
    """The first of `respond` alone, in less time."""
    return _climbed(frequency, _sheets(medium, source), medium.channels, A)[0] / (2.0 * A)


def respond_sheets(
    frequency: ArrayLike, layer: Layer, thickness_mm: Floats, A: float
) -> tuple[Floats, Floats]:
    """`respond` of layers that are as thick as n numbers say, each by itself: (n, m, c) by m frequencies."""
    ones = np.ones(len(layer.sigma_a))
    sheet = _Sheet(layer, thickness_mm[:, None, None], ones, np.zeros_like(ones))
    return _respond(frequency, [sheet], len(ones), A)


def _respond(frequency: ArrayLike, sheets: list[_Sheet], channels: int, A: float) -> tuple[Floats, Floats]:
    """`respond` of sheets, topmost first."""
    fluence, passages = _climbed(frequency, sheets, channels, A)
    R = fluence / (2.0 * A)
    for passage in passages:
        fluence = passage.down(fluence)
    return R, fluence / (2.0 * A)


def _climbed(
    frequency: ArrayLike, sheets: list[_Sheet], channels: int, A: float
) -> tuple[Floats, list[_Passage]]:
    """The fluence on top, and the ways down through the sheets."""
    s = np.asarray(frequency, dtype=np.float64)[..., None]
    zero = np.zeros((*s.shape[:-1], channels))
    face, passages = _Face(zero + 1.0 / (2.0 * A), zero), list[_Passage]()
    for sheet in reversed(sheets):
        face, passage = _climb(s, sheet, face)
        passages.insert(0, passage)
    return np.asarray(2.0 * A * face.W / (1.0 + 2.0 * A * face.Z)), passages


def _climb(s: Floats, sheet: _Sheet, below: _Face) -> tuple[_Face, _Passage]:
    """The condition at a sheet's upper face from that at its lower one."""
    layer, d = sheet.layer, sheet.thickness_mm
    D, sigma_t = layer.D, layer.sigma_t_prime
    q = np.sqrt(layer.sigma_tr**2 + s**2)
    source = layer.sigma_s_prime * sheet.beam / D
    slope = source / (sigma_t + q)  # of a particular solution that is 0 at the upper face
    if np.all(np.isinf(d)):
        return _Face(D * q, D * slope), _Passage()
    E = np.exp(-q * d)
    gap = np.abs(sigma_t - q)
    near = np.where(gap * d < 1e-8, d, -np.expm1(-gap * d) / np.where(gap > 0.0, gap, 1.0))
    lower = source * np.exp(-np.minimum(q, sigma_t) * d) * near / (sigma_t + q)
    lower_slope = slope * E - sigma_t * lower
    rho = (D * q - below.Z) / (D * q + below.Z)
    W = below.W + sheet.point  # a source on the face makes the flux jump
    beta = (W - below.Z * lower - D * lower_slope) / (D * q + below.Z)
    common = 1.0 / (1.0 + E**2 * rho)
    face = _Face(D * q * (1.0 - E**2 * rho) * common, 2.0 * D * q * beta * E * common + D * slope)
    # phi at the lower face is a E + b + P, with a = (phi0 - beta E) common and b = a E rho + beta.
    return face, _Passage(E, rho, common, beta, lower)


def _sheets(medium: Medium, source: Source) -> list[_Sheet]:
    return list(_beam(medium) if source == "beam" else _split(medium))


def _beam(medium: Medium) -> Iterator[_Sheet]:
    depth = np.zeros(medium.channels)
    for layer in medium.layers:
        yield _Sheet(layer, layer.thickness_mm, np.exp(-depth), np.zeros(medium.channels))
        depth = depth + layer.sigma_t_prime * layer.thickness_mm


def _split(medium: Medium) -> Iterator[_Sheet]:
    """The layers, each in two sheets; a source lies where the beam's optical depth is one."""
    depth = np.zeros(medium.channels)
    nothing = np.zeros(medium.channels)
    for i, layer in enumerate(medium.layers):
        d, sigma_t = layer.thickness_mm, layer.sigma_t_prime
        deep = depth + sigma_t * d >= 1.0
        # A slab thinner than that has its source in the middle of its last layer, rather than nowhere.
        here = (depth < 1.0) & (deep | (i == len(medium.layers) - 1))
        middle = 0.5 * d if np.isfinite(d) else 1.0
        above = np.where(here & deep, (1.0 - depth) / sigma_t, middle)
        yield _Sheet(layer, above, nothing, np.where(here, layer.alpha_prime, 0.0))
        yield _Sheet(layer, d - above, nothing, nothing)
        depth = depth + sigma_t * d
