"""Diffusion profile that varies over a picture: in each texel, a mixture of three profiles."""

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
PROFILE_GRID_CORNERS = {"profile": (0, 0), "profile_blood": (0, -1), "profile_dark": (-1, -1)}
"""Dictionary from the file name of each profile to its indices on the grid of melanin and blood. The profiles
are those of pale skin with little blood, pale skin with much blood, and dark skin with much blood."""
WEIGHT_MAP_NAME = "profile_map"
_PIGMENT_GRID_NODES_PER_AXIS = 4  # number of grid nodes along the logarithms of melanin and of blood
_PIGMENT_GRID_PERCENTILES = 0.5, 99.5  # percentiles of the pigments of the skin texels, which bound the grid
# Smallest volume fraction of a grid axis, and smallest ratio of its ends.
_MIN_VOLUME_FRACTION, _MIN_AXIS_RATIO = 1e-3, 1.02
_UNIT_SUM_EQUATION_WEIGHT = 1e4  # weight of the equation by which the mixture weights sum to 1


@dataclass(frozen=True, eq=False)
class ProfileMixture:
    """Three diffusion profiles with the same variances, and a map of their weights.

    profiles : profiles of pale skin with little blood, of pale skin with much blood, and of dark skin with
        much blood
    weights : (h, w, 2) weights of the second and the third profile; all weights sum to 1 [-]
    error : (3,) relative root-mean-square error of the mixture over the skins of a grid of pigments, by
        channel. It is the error of the fractions of light that leave the skin through concentric rings around
        the point where the light enters [-]
    single_error : (3,) the same error if the profile from the middle of the grid is used for all skins [-]
    """

    profiles: tuple[GaussianSum, ...]
    weights: Pixels
    error: Floats
    single_error: Floats

    def summary(self) -> dict[str, list[float]]:
        """Return the errors by channel of the mixture ("mixed") and of a single profile ("one_profile").

        The result is a dictionary of lists for a JSON file; see the fields `error` and `single_error`.
        """
        return {"mixed": self.error.tolist(), "one_profile": self.single_error.tolist()}


def profile_mixture(unmix_result: UnmixResult) -> ProfileMixture:
    """Return three profiles, and their weights in each texel from the texel's melanin and blood.

    Raises DermisError for a picture without skin.
    """
    skin = unmix_result.skin_texels()
    if not skin.any():
        refuse("widths", "a picture of skin", "no texel is like skin", "Give the skin's albedo")
    axes = [_pigment_axis(one[skin]) for one in (unmix_result.melanin, unmix_result.blood)]
    tissues = [_spectral_tissue(unmix_result.skin, m, b) for m, b in product(*axes)]
    nodes = np.array([_ring_fractions(one) for one in tissues])
    corners = [
        (m % _PIGMENT_GRID_NODES_PER_AXIS) * _PIGMENT_GRID_NODES_PER_AXIS + b % _PIGMENT_GRID_NODES_PER_AXIS
        for m, b in PROFILE_GRID_CORNERS.values()
    ]
    weights = _mixture_weights(nodes, nodes[corners])
    middle = nodes[
        (_PIGMENT_GRID_NODES_PER_AXIS // 2) * _PIGMENT_GRID_NODES_PER_AXIS + _PIGMENT_GRID_NODES_PER_AXIS // 2
    ]
    mixed = np.einsum("nk,krc->nrc", weights, nodes[corners])
    profiles = [fit_profile(tissues[k], name) for k, name in zip(corners, PROFILE_GRID_CORNERS, strict=True)]
    weight_map = _interpolate_weight_map(
        weights[:, 1:].reshape(_PIGMENT_GRID_NODES_PER_AXIS, _PIGMENT_GRID_NODES_PER_AXIS, 2),
        axes,
        unmix_result,
    )
    errors = _rms_error(mixed, nodes), _rms_error(middle[None], nodes)
    return ProfileMixture(shared_gaussians(profiles), weight_map, *errors)


def save_mixture(folder: Path, mixture: ProfileMixture) -> list[Path]:
    """Write the three profiles and the map of weights atomically; return the paths of the files.

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    written = [folder / f"{name}.toml" for name in PROFILE_GRID_CORNERS]
    for path, profile in zip(written, mixture.profiles, strict=True):
        write_profile(path, profile, {})
    path = folder / f"{WEIGHT_MAP_NAME}.exr"
    with atomic_file(path) as file:
        file.write_bytes(encode_exr(np.dstack([mixture.weights, np.zeros_like(mixture.weights[..., :1])])))
    return [*written, path]


def _pigment_axis(volume_fractions: Pixels) -> Floats:
    low, high = np.maximum(np.percentile(volume_fractions, _PIGMENT_GRID_PERCENTILES), _MIN_VOLUME_FRACTION)
    return np.geomspace(low, max(high, _MIN_AXIS_RATIO * low), _PIGMENT_GRID_NODES_PER_AXIS)


def _spectral_tissue(skin: SkinParameters, melanin: float, blood: float) -> Tissue:
    fixed = {name: getattr(skin, name) for name in ("eumelanin", "oxygen", "epidermis_mm", "baseline")}
    return load_tissue("spectral", pigments={"melanin": float(melanin), "blood": float(blood), **fixed})


def _ring_fractions(tissue: Tissue) -> Floats:
    """Return the fraction (n, 3) of a tissue's diffuse reflectance that emerges through each of n rings.

    The rings are concentric around the point where light enters.
    """
    rings = tissue.ring_target()
    return np.asarray(rings.energy / rings.total)


def _mixture_weights(skin_ring_fractions: Floats, profile_ring_fractions: Floats) -> Floats:
    """Return the weights (n, k) with which mixtures of k profiles approximate the profiles of n skins.

    The weights are fitted to fractions of the reflectance, see `_ring_fractions`. The weights of each skin
    are not negative and sum to 1.

    skin_ring_fractions : ring fractions of the n skins, which are the nodes of a grid of pigments
    profile_ring_fractions : ring fractions of the k profiles that are mixed
    """
    from scipy.optimize import nnls

    equations = np.vstack(
        [
            profile_ring_fractions.reshape(len(profile_ring_fractions), -1).T,
            np.full((1, len(profile_ring_fractions)), _UNIT_SUM_EQUATION_WEIGHT),
        ]
    )
    weights = np.array(
        [
            nnls(equations, np.append(node.ravel(), _UNIT_SUM_EQUATION_WEIGHT))[0]
            for node in skin_ring_fractions
        ]
    )
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def _rms_error(mixed_ring_fractions: Floats, skin_ring_fractions: Floats) -> Floats:
    """Return the relative root-mean-square error (3,) of mixtures of profiles, by channel.

    mixed_ring_fractions : (n, r, 3) ring fractions (see `_ring_fractions`) of the mixtures for n skins
    skin_ring_fractions : (n, r, 3) ring fractions of these skins
    """
    squares = ((mixed_ring_fractions - skin_ring_fractions) ** 2).sum(axis=1) / (skin_ring_fractions**2).sum(
        axis=1
    )
    return np.asarray(np.sqrt(squares.mean(axis=0)))


def _interpolate_weight_map(
    grid_weights: Floats, pigment_axes: Sequence[Floats], unmix_result: UnmixResult
) -> Pixels:
    """Return mixture weights (h, w, 2) of each texel, interpolated from the nodes of a pigment grid.

    The nodes are evenly spaced in the logarithms of melanin and blood.

    grid_weights : (m, b, 2) weights of the second and the third profile at the nodes
    pigment_axes : melanin fractions (m,) and blood fractions (b,) of the nodes
    unmix_result : melanin and blood of each texel
    """
    from scipy.interpolate import RegularGridInterpolator

    logarithms = [np.log(axis) for axis in pigment_axes]
    interpolator = RegularGridInterpolator(logarithms, grid_weights, bounds_error=False, fill_value=None)
    result = np.empty((*unmix_result.melanin.shape, 2), np.float32)
    for row, row_values in enumerate(zip(unmix_result.melanin, unmix_result.blood, strict=True)):
        coordinates = [
            np.log(np.clip(one, a[0], a[-1])) for one, a in zip(row_values, pigment_axes, strict=True)
        ]
        result[row] = interpolator(np.stack(coordinates, axis=-1))
    return result
