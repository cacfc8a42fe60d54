"""Multipole model: diffusion in slabs, with point sources mirrored at both faces, and in stacks of slabs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.diffusion import dipole
from dermis.optics.media import Floats, Layer, Medium

SourceDepthClamp = Literal["none", "layer"]


@dataclass(frozen=True)
class Slab:
    """Layer between two faces, as input of the multipole model.

    layer : absorption, scattering and thickness; the thickness may be infinite
    A_top, A_bottom : boundary mismatch of the upper and the lower face; 1 at index-matched faces [-]
    clamp : "none" for a source at a depth of one mean free path, as published, even if this is below the
        slab; "layer" for a source at this depth, but at most at the lower face

    Source: [DonnerJensen2005] section 3.1; boundaries after [Contini1997].
    """

    layer: Layer
    A_top: float
    A_bottom: float
    clamp: SourceDepthClamp = "layer"

    @property
    def source_depth_mm(self) -> Floats:
        """Return the depth (c,) of the real point source below the upper face [mm]."""
        l, d = self.layer.mean_free_path_mm, self.layer.thickness_mm
        return np.minimum(l, d) if self.clamp == "layer" else l

    @property
    def extrapolation_distances_mm(self) -> tuple[Floats, Floats]:
        """Return the distances (c,) above and below the slab where the extrapolated fluence is 0 [mm]."""
        return 2.0 * self.A_top * self.layer.D, 2.0 * self.A_bottom * self.layer.D

    @property
    def image_period_mm(self) -> Floats:
        """Return the depth interval (c,) after which the mirror images repeat [mm]."""
        return np.asarray(2.0 * (self.layer.thickness_mm + sum(self.extrapolation_distances_mm)))

    def upside_down(self) -> Slab:
        """Return the slab upside down, to solve for light that enters from below."""
        return Slab(self.layer, self.A_bottom, self.A_top, self.clamp)


def reflectance_hankel(frequency: ArrayLike, slab: Slab) -> Floats:
    """Return the Hankel transform (n, c) of R(r) of a slab at frequencies [1/mm], in closed form."""
    if np.isinf(slab.layer.thickness_mm):
        return dipole.reflectance_hankel(frequency, slab.layer, slab.A_top)
    l, top = slab.source_depth_mm, slab.extrapolation_distances_mm[0]
    return _image_sum(frequency, slab, l, -l - 2.0 * top)


def transmittance_hankel(frequency: ArrayLike, slab: Slab) -> Floats:
    """Return the Hankel transform (n, c) of T(r) of a slab at frequencies [1/mm], in closed form."""
    l, top, d = slab.source_depth_mm, slab.extrapolation_distances_mm[0], slab.layer.thickness_mm
    if np.isinf(d):
        return np.zeros((*np.shape(frequency), len(l)))
    return _image_sum(frequency, slab, d - l, d + l + 2.0 * top)


def reflectance(radius_mm: ArrayLike, slab: Slab, tolerance: float = 1e-8) -> Floats:
    """Return the reflected profile R(r), (n, c), of a slab, relative to the power that enters [1/mm2].

    radius_mm : (n,) distances r from the beam [mm]
    tolerance : upper bound of the light from all omitted image sources, relative to the power that enters [-]

    Source: [DonnerJensen2005] eq. 2-6.
    """
    if np.isinf(slab.layer.thickness_mm):
        return dipole.reflectance(radius_mm, slab.layer, slab.A_top)
    l, top = slab.source_depth_mm, slab.extrapolation_distances_mm[0]
    return _image_series(radius_mm, slab, lambda shift: (l + shift, shift - l - 2.0 * top), tolerance)


def transmittance(radius_mm: ArrayLike, slab: Slab, tolerance: float = 1e-8) -> Floats:
    """Return the transmitted profile T(r), (n, c), of a slab, relative to the power that enters [1/mm2].

    radius_mm : (n,) distances r from the beam [mm]
    tolerance : upper bound of the light from all omitted image sources, relative to the power that enters [-]

    If the clamp moves the source onto the lower face, half of the source's light leaves directly at r = 0.
    This light is missing here, but `transmittance_hankel` includes it.

    Source: [DonnerJensen2005] eq. 7, 8.
    """
    l, top, d = slab.source_depth_mm, slab.extrapolation_distances_mm[0], slab.layer.thickness_mm
    if np.isinf(d):
        return np.zeros((*np.shape(radius_mm), len(l)))
    return _image_series(radius_mm, slab, lambda shift: (d - l - shift, d + l + 2.0 * top - shift), tolerance)


def _image_sum(frequency: ArrayLike, slab: Slab, real_source: Floats, image_source: Floats) -> Floats:
    """Return the Hankel transform (n, c) of R(r) or T(r) of a slab, a sum over periodic point sources.

    The result is half the albedo times the difference of two series, one for the real sources and one for
    their images. Each series is the sum of sign(z + i P) exp(-|z + i P| q) over all integers i. Here, P is
    the period of the sources and q = sqrt(sigma_tr^2 + s^2).

    frequency : (n,) frequencies s [1/mm]
    real_source, image_source : (c,) signed distances z from the face to one real source and to one image [mm]
    """
    q = np.sqrt(slab.layer.sigma_tr**2 + np.asarray(frequency, dtype=np.float64)[..., None] ** 2)
    P = slab.image_period_mm

    def periodic_source_sum(source_distance: Floats) -> Floats:
        z0 = np.mod(source_distance, P)  # the series is odd and periodic: the sum of two geometric series
        return np.asarray((np.exp(-z0 * q) - np.exp(-(P - z0) * q)) / -np.expm1(-P * q))

    return np.asarray(
        0.5 * slab.layer.alpha_prime * (periodic_source_sum(real_source) - periodic_source_sum(image_source))
    )


def _image_series(
    radius_mm: ArrayLike, slab: Slab, source_pair: Callable[[Floats], tuple[Floats, Floats]], tolerance: float
) -> Floats:
    result = np.zeros((*np.shape(radius_mm), len(slab.source_depth_mm)))
    for i in range(-(n := image_pairs_needed(slab, tolerance)), n + 1):
        real, image = source_pair(i * slab.image_period_mm)
        result += dipole.point_source_flux(radius_mm, real, slab.layer.sigma_tr)
        result -= dipole.point_source_flux(radius_mm, image, slab.layer.sigma_tr)
    return np.asarray(slab.layer.alpha_prime * result)


def image_pairs_needed(slab: Slab, tolerance: float, max_pairs: int = 2000) -> int:
    """Return how many pairs of image sources the multipole model needs on each side of a slab.

    tolerance : upper bound of the light from all omitted pairs, relative to the power that enters [-]
    max_pairs : largest result; also the result for a slab without absorption, where no bound can be computed
    """
    decay = float((slab.image_period_mm * slab.layer.sigma_tr).min())
    if decay <= 0.0:
        return max_pairs
    log_ratio = np.log(4.0 / (tolerance * -np.expm1(-decay)))
    return int(min(max_pairs, np.ceil(log_ratio / decay) + 2))


@dataclass(frozen=True)
class StackResponse:
    """Hankel transforms (n, c) of the reflectance and the transmittance of a stack of layers [-].

    R_above, T_down : transforms of reflectance and transmittance for light from above
    R_below, T_up : transforms of reflectance and transmittance for light from below
    """

    R_above: Floats
    T_down: Floats
    R_below: Floats
    T_up: Floats

    def placed_over(self, lower_stack: StackResponse) -> StackResponse:
        """Return the combined response of this stack on top of another stack.

        Source: [DonnerJensen2005] section 3.3, after Kubelka's addition of layers.
        """
        between = 1.0 / (1.0 - self.R_below * lower_stack.R_above)
        return StackResponse(
            self.R_above + self.T_down * lower_stack.R_above * between * self.T_up,
            self.T_down * between * lower_stack.T_down,
            lower_stack.R_below + lower_stack.T_up * self.R_below * between * lower_stack.T_down,
            lower_stack.T_up * between * self.T_up,
        )


def stack_response(
    frequency: ArrayLike, medium: Medium, boundary_mismatch: float, clamp: SourceDepthClamp = "layer"
) -> StackResponse:
    """Return the response of the stack of all layers of a medium, at frequencies s [1/mm].

    boundary_mismatch : boundary mismatch with air, above and below; internal interfaces are index-matched [-]
    clamp : whether sources are kept inside thin layers ("layer") or not ("none"), see `Slab`
    """
    slabs = layer_slabs(medium, boundary_mismatch, clamp)
    stack = _single_slab_response(frequency, slabs[-1])
    for slab in reversed(slabs[:-1]):
        stack = _single_slab_response(frequency, slab).placed_over(stack)
    return stack


def layer_slabs(medium: Medium, boundary_mismatch: float, clamp: SourceDepthClamp = "layer") -> list[Slab]:
    """Return one slab per layer of a medium.

    boundary_mismatch : boundary mismatch of the faces that touch air; all other faces are index-matched [-]
    clamp : whether sources are kept inside thin layers ("layer") or not ("none"), see `Slab`
    """
    last = len(medium.layers) - 1
    layers = enumerate(medium.layers)
    return [
        Slab(layer, boundary_mismatch if i == 0 else 1.0, boundary_mismatch if i == last else 1.0, clamp)
        for i, layer in layers
    ]


def _single_slab_response(frequency: ArrayLike, slab: Slab) -> StackResponse:
    R, T = reflectance_hankel(frequency, slab), transmittance_hankel(frequency, slab)
    if np.isinf(slab.layer.thickness_mm):  # no light comes from below
        return StackResponse(R, T, np.zeros_like(R), np.zeros_like(R))
    below = slab.upside_down()
    return StackResponse(R, T, reflectance_hankel(frequency, below), transmittance_hankel(frequency, below))
