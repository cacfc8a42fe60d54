"""Diffusion width of each texel: three profiles and a map that mixes them."""

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
"""Files of the profiles, and which ends of melanin and of blood they have: pale and bloodless, pale with
blood, dark with blood."""
MAP_NAME = "profile_map"
_NODES = 4  # along the logarithms of melanin and of blood
_PERCENTILES = 0.5, 99.5  # percentiles of the skin between which profiles are mixed
_MIN_FRACTION, _MIN_RATIO = 1e-3, 1.02  # of a share; of the ends
_SUM_WEIGHT = 1e4  # of the equation that shares sum to 1


@dataclass(frozen=True, eq=False)
class ProfileMixture:
    """Three profiles on the same Gaussians, and a map that mixes them.

    shares : (h, w, 2) of the second and the third [-]
    error, alone : (3,) root mean square over the grid of E_b, by channel, of the mixture against each node's
        own profile of equal energy; and of the one profile at the middle instead [-]
    """

    profiles: tuple[GaussianSum, ...]
    shares: Pixels
    error: Floats
    alone: Floats

    def summary(self) -> dict[str, list[float]]:
        """Return the errors."""
        return {"mixed": self.error.tolist(), "one_profile": self.alone.tolist()}


def profile_mixture(found: UnmixResult) -> ProfileMixture:
    """Return three profiles and their shares by each texel's melanin and blood, clamped to their ends.

    Raises DermisError for a picture without skin.
    """
    skin = found.skin_texels()
    if not skin.any():
        refuse("widths", "a picture of skin", "no texel is like skin", "Give the skin's albedo")
    axes = [_axis(one[skin]) for one in (found.melanin, found.blood)]
    tissues = [_tissue(found.skin, m, b) for m, b in product(*axes)]
    nodes = np.array([_ring_fractions(one) for one in tissues])
    corners = [(m % _NODES) * _NODES + b % _NODES for m, b in PROFILE_CORNERS.values()]
    shares = _mixture_weights(nodes, nodes[corners])
    middle = nodes[(_NODES // 2) * _NODES + _NODES // 2]
    mixed = np.einsum("nk,krc->nrc", shares, nodes[corners])
    profiles = [fit_profile(tissues[k], name) for k, name in zip(corners, PROFILE_CORNERS, strict=True)]
    over_map = _interpolate_map(shares[:, 1:].reshape(_NODES, _NODES, 2), axes, found)
    return ProfileMixture(shared_gaussians(profiles), over_map, _rms_error(mixed, nodes), _rms_error(middle[None], nodes))


def save_mixture(folder: Path, widths: ProfileMixture) -> list[Path]:
    """Write the profiles and the map, each whole or not at all.

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    written = [folder / f"{name}.toml" for name in PROFILE_CORNERS]
    for path, profile in zip(written, widths.profiles, strict=True):
        write_profile(path, profile, {})
    path = folder / f"{MAP_NAME}.exr"
    with atomic_file(path) as trial:
        trial.write_bytes(encode_exr(np.dstack([widths.shares, np.zeros_like(widths.shares[..., :1])])))
    return [*written, path]


def _axis(shares: Pixels) -> Floats:
    low, high = np.maximum(np.percentile(shares, _PERCENTILES), _MIN_FRACTION)
    return np.geomspace(low, max(high, _MIN_RATIO * low), _NODES)


def _tissue(skin: SkinParameters, melanin: float, blood: float) -> Tissue:
    held = {name: getattr(skin, name) for name in ("eumelanin", "oxygen", "epidermis_mm")}
    return load_tissue("spectral", pigments={"melanin": float(melanin), "blood": float(blood), **held})


def _ring_fractions(tissue: Tissue) -> Floats:
    """Return the share (n, 3) of the diffuse reflectance that leaves through each ring."""
    rings = tissue.rings()
    return np.asarray(rings.energy / rings.total)


def _mixture_weights(nodes: Floats, corners: Floats) -> Floats:
    """Return shares (n, k) of the corners that approximate each node: non-negative, with sum 1."""
    from scipy.optimize import nnls

    sides = np.vstack([corners.reshape(len(corners), -1).T, np.full((1, len(corners)), _SUM_WEIGHT)])
    found = np.array([nnls(sides, np.append(node.ravel(), _SUM_WEIGHT))[0] for node in nodes])
    return np.asarray(found / found.sum(axis=1, keepdims=True))


def _rms_error(made: Floats, nodes: Floats) -> Floats:
    """Return the root mean square of E_b over all nodes (3,)."""
    squares = ((made - nodes) ** 2).sum(axis=1) / (nodes**2).sum(axis=1)
    return np.asarray(np.sqrt(squares.mean(axis=0)))


def _interpolate_map(shares: Floats, axes: Sequence[Floats], found: UnmixResult) -> Pixels:
    """Return shares (h, w, 2) interpolated between nodes in the logarithms of melanin and blood."""
    from scipy.interpolate import RegularGridInterpolator

    between = RegularGridInterpolator([np.log(axis) for axis in axes], shares)
    made = np.empty((*found.melanin.shape, 2), np.float32)
    for row, both in enumerate(zip(found.melanin, found.blood, strict=True)):
        places = [np.log(np.clip(one, a[0], a[-1])) for one, a in zip(both, axes, strict=True)]
        made[row] = between(np.clip(np.stack(places, axis=-1), *_log_limits(axes)))
    return made


def _log_limits(axes: Sequence[Floats]) -> tuple[Floats, Floats]:
    return np.log([axis[0] for axis in axes]), np.log([axis[-1] for axis in axes])
