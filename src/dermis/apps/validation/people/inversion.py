"""Pigments of measured spectra by inversion of the package's model of skin."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles
from dermis.images.colour import lab
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.optics.pigments.spectra import WAVELENGTHS_NM, rgb_weights
from dermis.optics.skin_colours import spectral_table

_OXYGEN_NODES = np.linspace(0.0, 1.0, 5)
_EPIDERMIS_NODES_MM = np.geomspace(0.02, 0.2, 6)
_NODES = 65
_PRIOR_OXYGEN, _PRIOR_OXYGEN_SD, _PRIOR_LOG_MM_SD = 0.7, 0.3, 0.3
_START_MELANIN, _START_BLOOD = 0.04, 0.01
_LAB_SD: Final = 0.1
"""Standard deviation of colours in the fit [CIELAB]; small, so that colours take precedence over spectra."""
_SPECTRUM_SD: Final = 0.01
_STEPS = 30
_DERIVATIVE_STEP = 1e-3
Residuals = Callable[[Doubles], Doubles]
_LOW = np.array([0.01, 0.01, 0.0, np.log(_EPIDERMIS_NODES_MM[0])])
_HIGH = np.array([0.9, 0.6, 1.0, np.log(_EPIDERMIS_NODES_MM[-1])])


@cache
def _log_spectra() -> Doubles:
    """Return logarithms of reflectance (thickness, oxygen, melanin, blood, 31) on the nodes of the table."""
    return np.log(
        [
            [
                spectral_table(replace(DEFAULT_SKIN, oxygen=float(oxygen), epidermis_mm=float(mm)), _NODES)
                for oxygen in _OXYGEN_NODES
            ]
            for mm in _EPIDERMIS_NODES_MM
        ]
    )


def model_spectra(unknowns: Doubles) -> Doubles:
    """Return the diffuse reflectance (n, 31) of skins by interpolation of logarithms.

    unknowns : (n, 4) square roots of the melanin and blood fractions, oxygen, logarithm of the thickness [mm]
    """
    table = _log_spectra()
    thickness = np.interp(
        unknowns[:, 3], np.log(_EPIDERMIS_NODES_MM), np.arange(len(_EPIDERMIS_NODES_MM), dtype=np.float64)
    )
    fractions = np.clip(unknowns[:, [2, 0, 1]], 0.0, 1.0) * (np.array(table.shape[1:4]) - 1)
    positions = np.column_stack([thickness, fractions])
    cells = np.minimum(positions.astype(np.int64), np.array(table.shape[:4]) - 2)
    offsets = positions - cells
    result = np.zeros((len(unknowns), table.shape[4]))
    for corner in product((0, 1), repeat=4):
        weight = np.prod(np.where(corner, offsets, 1.0 - offsets), axis=1)
        result += weight[:, None] * table[tuple((cells + corner).T)]
    return np.exp(result)


def model_lab(unknowns: Doubles) -> Doubles:
    """Return the CIELAB colours (n, 3) of skins; unknowns as in `model_spectra`."""
    return lab(model_spectra(unknowns) @ rgb_weights(WAVELENGTHS_NM).T)


def invert_spectra(reflectance: Doubles) -> Doubles:
    """Return the unknowns (n, 4) of `model_spectra` that match spectra, colours before shapes.

    reflectance : (n, 31) at `WAVELENGTHS_NM`, without surface reflection [-]

    Takes Gauss-Newton steps with Levenberg's damping. The priors of oxygen and thickness only matter where
    the spectrum does not determine these unknowns.
    """
    target = lab(reflectance @ rgb_weights(WAVELENGTHS_NM).T)
    prior = np.array([_PRIOR_OXYGEN, np.log(DEFAULT_SKIN.epidermis_mm)])
    spectrum_sd = _SPECTRUM_SD * np.sqrt(len(WAVELENGTHS_NM) / 9.0)  # neighbouring wavelengths err together

    def residuals(x: Doubles) -> Doubles:
        spectra = model_spectra(x)
        colours = (lab(spectra @ rgb_weights(WAVELENGTHS_NM).T) - target) / _LAB_SD
        priors = (x[:, 2:] - prior) / (_PRIOR_OXYGEN_SD, _PRIOR_LOG_MM_SD)
        return np.hstack([(spectra - reflectance) / spectrum_sd, colours, priors])

    start = np.array([_START_MELANIN**0.5, _START_BLOOD**0.5, *prior])
    return _least_squares(residuals, np.tile(start, (len(reflectance), 1)))


def _least_squares(residuals: Residuals, x: Doubles) -> Doubles:
    r = residuals(x)
    cost, damping = (r**2).sum(axis=1), np.full(len(x), 1e-2)
    for _ in range(_STEPS):
        J = np.stack([(residuals(_moved(x, k)) - r) / _DERIVATIVE_STEP for k in range(4)], axis=-1)
        H, g = np.einsum("nri,nrj->nij", J, J), -np.einsum("nri,nr->ni", J, r)
        H[:, range(4), range(4)] *= 1.0 + damping[:, None]
        trial = np.clip(x + np.linalg.solve(H, g[..., None])[..., 0], _LOW, _HIGH)
        trial_r = residuals(trial)
        trial_cost = (trial_r**2).sum(axis=1)
        better: NDArray[np.bool_] = trial_cost < cost
        x, r = np.where(better[:, None], trial, x), np.where(better[:, None], trial_r, r)
        cost, damping = np.where(better, trial_cost, cost), damping * np.where(better, 0.3, 5.0)
    return x


def _moved(x: Doubles, column: int) -> Doubles:
    moved = x.copy()
    moved[:, column] += _DERIVATIVE_STEP
    return moved


def to_variables(unknowns: Doubles) -> Doubles:
    """Return log2 of melanin and blood, oxygen, and log2 of the thickness [mm], (n, 4).

    unknowns : as in `model_spectra`
    """
    melanin, blood, oxygen, log_mm = unknowns.T
    return np.column_stack([2.0 * np.log2(melanin), 2.0 * np.log2(blood), oxygen, log_mm / np.log(2.0)])


def from_variables(variables: Doubles) -> Doubles:
    """Return the unknowns of `model_spectra` for variables as in `to_variables`."""
    melanin, blood, oxygen, mm = variables.T
    unknowns = np.column_stack([np.exp2(0.5 * melanin), np.exp2(0.5 * blood), oxygen, mm * np.log(2.0)])
    return np.asarray(np.clip(unknowns, _LOW, _HIGH))
