"""Spatially varying diffusion profile of a picture: three profiles and a map that mixes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.unmixing.unmix import UnmixResult
from dermis.base.atomic_write import atomic_file
from dermis.base.errors import refuse
from dermis.images.hdr import encode_exr
from dermis.optics.fits.gaussian import shared_gaussians
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Floats
from dermis.optics.pigments.parameters import SkinParameters
from dermis.optics.profiles import fit_profile, write_profile
from dermis.optics.tissue import Tissue, load_tissue

Pixels = NDArray[np.float32]
PROFILE_CORNERS = {"profile": (0, 0), "profile_blood": (0, -1), "profile_dark": (-1, -1)}
"""Names of the profiles' files, with their indices along melanin and blood: pale without blood, pale with
blood, dark with blood."""
MAP_NAME = "profile_map"
_NODES = 4  # along the logarithms of melanin and of blood
_PERCENTILES = 0.5, 99.5  # of the skin, between which profiles are mixed
_MIN_FRACTION, _MIN_RATIO = 1e-3, 1.02  # of a volume fraction, and between the ends of an axis
_SUM_WEIGHT = 1e4  # of the equation that the weights sum to 1


@dataclass(frozen=True, eq=False)
class ProfileMixture:
    """Three profiles on the same Gaussians, and a map of their weights.

    weights : (h, w, 2) weights of the second and the third profile [-]
    error, single_error : (3,) relative RMS error of ring energies over a grid of pigments, by channel, of the
        mixture and of the single profile in the middle of the grid [-]
    """

    profiles: tuple[GaussianSum, ...]
    weights: Pixels
    error: Floats
    single_error: Floats

    def summary(self) -> dict[str, list[float]]:
        """Return the errors."""
        return {"mixed": self.error.tolist(), "one_profile": self.single_error.tolist()}


def profile_mixture(unmixed: UnmixResult) -> ProfileMixture:
    """Return three profiles, and their weights by each texel's melanin and blood.

    Raises DermisError for a picture without skin.
    """
    skin = unmixed.skin_texels()
    if not skin.any():
        refuse("widths", "a picture of skin", "no texel is like skin", "Give the skin's albedo")
    axes = [_axis(one[skin]) for one in (unmixed.melanin, unmixed.blood)]
    tissues = [_tissue(unmixed.skin, m, b) for m, b in product(*axes)]
    nodes = np.array([_ring_fractions(one) for one in tissues])
    corners = [(m % _NODES) * _NODES + b % _NODES for m, b in PROFILE_CORNERS.values()]
    weights = _mixture_weights(nodes, nodes[corners])
    middle = nodes[(_NODES // 2) * _NODES + _NODES // 2]
    mixed = np.einsum("nk,krc->nrc", weights, nodes[corners])
    profiles = [fit_profile(tissues[k], name) for k, name in zip(corners, PROFILE_CORNERS, strict=True)]
    weight_map = _interpolate_map(weights[:, 1:].reshape(_NODES, _NODES, 2), axes, unmixed)
    errors = _rms_error(mixed, nodes), _rms_error(middle[None], nodes)
    return ProfileMixture(shared_gaussians(profiles), weight_map, *errors)


def save_mixture(folder: Path, mixture: ProfileMixture) -> list[Path]:
    """Write the profiles and the map of weights, each file atomically.

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    written = [folder / f"{name}.toml" for name in PROFILE_CORNERS]
    for path, profile in zip(written, mixture.profiles, strict=True):
        write_profile(path, profile, {})
    path = folder / f"{MAP_NAME}.exr"
    with atomic_file(path) as file:
        file.write_bytes(encode_exr(np.dstack([mixture.weights, np.zeros_like(mixture.weights[..., :1])])))
    return [*written, path]


def _axis(fractions: Pixels) -> Floats:
    low, high = np.maximum(np.percentile(fractions, _PERCENTILES), _MIN_FRACTION)
    return np.geomspace(low, max(high, _MIN_RATIO * low), _NODES)


def _tissue(skin: SkinParameters, melanin: float, blood: float) -> Tissue:
    fixed = {name: getattr(skin, name) for name in ("eumelanin", "oxygen", "epidermis_mm")}
    return load_tissue("spectral", pigments={"melanin": float(melanin), "blood": float(blood), **fixed})


def _ring_fractions(tissue: Tissue) -> Floats:
    """Return the fraction (n, 3) of the diffuse reflectance that leaves through each ring."""
    rings = tissue.rings()
    return np.asarray(rings.energy / rings.total)


def _mixture_weights(nodes: Floats, corners: Floats) -> Floats:
    """Return non-negative weights (n, k) with sum 1 of the corners, which approximate each node."""
    from scipy.optimize import nnls

    equations = np.vstack([corners.reshape(len(corners), -1).T, np.full((1, len(corners)), _SUM_WEIGHT)])
    weights = np.array([nnls(equations, np.append(node.ravel(), _SUM_WEIGHT))[0] for node in nodes])
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _rms_error(result: Floats, nodes: Floats) -> Floats:
    """Return the relative RMS error over all nodes, by channel (3,)."""
    squares = ((result - nodes) ** 2).sum(axis=1) / (nodes**2).sum(axis=1)
    return np.asarray(np.sqrt(squares.mean(axis=0)))


def _interpolate_map(weights: Floats, axes: Sequence[Floats], unmixed: UnmixResult) -> Pixels:
    """Return weights (h, w, 2) interpolated between nodes in the logarithms of melanin and blood."""
    from scipy.interpolate import RegularGridInterpolator

    logarithms = [np.log(axis) for axis in axes]
    interpolator = RegularGridInterpolator(logarithms, weights, bounds_error=False, fill_value=None)
    result = np.empty((*unmixed.melanin.shape, 2), np.float32)
    for row, row_values in enumerate(zip(unmixed.melanin, unmixed.blood, strict=True)):
        coordinates = [np.log(np.clip(one, a[0], a[-1])) for one, a in zip(row_values, axes, strict=True)]
        result[row] = interpolator(np.stack(coordinates, axis=-1))
    return result
