"""The multipole: a slab by mirror images in both of its faces, and stacks of slabs by frequency."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.diffusion import dipole
from dermis.optics.media import Floats, Layer, Medium

Clamp = Literal["none", "layer"]


@dataclass(frozen=True)
class Slab:
    """A layer between two faces, with its source placed.

    layer : the medium; its thickness may be infinite
    A_top, A_bottom : boundary mismatch of the faces; 1 where the index does not change [-]
    clamp : "none" puts the source one mean free path deep as printed, even below the slab; "layer" keeps
        it inside

    Source: [DonnerJensen2005] section 3.1; boundaries after [Contini1997].
    """

    layer: Layer
    A_top: float
    A_bottom: float
    clamp: Clamp = "layer"

    @property
    def source_mm(self) -> Floats:
        """Depth of the source, (c,) [mm]."""
        l, d = self.layer.mean_free_path_mm, self.layer.thickness_mm
        return np.minimum(l, d) if self.clamp == "layer" else l

    @property
    def z_b(self) -> tuple[Floats, Floats]:
        """Distance of the extrapolated boundary from either face, (c,) each [mm]."""
        return 2.0 * self.A_top * self.layer.D, 2.0 * self.A_bottom * self.layer.D

    @property
    def period_mm(self) -> Floats:
        """Distance after which the images repeat, (c,) [mm]."""
        return np.asarray(2.0 * (self.layer.thickness_mm + sum(self.z_b)))

    def flipped(self) -> Slab:
        """The slab as light from below meets it."""
        return Slab(self.layer, self.A_bottom, self.A_top, self.clamp)


def reflectance_hankel(frequency: ArrayLike, slab: Slab) -> Floats:
    """Hankel transform of R(r) by frequency [1/mm], the series of images in closed form, (n, c) [-]."""
    if np.isinf(slab.layer.thickness_mm):
        return dipole.reflectance_hankel(frequency, slab.layer, slab.A_top)
    l, top = slab.source_mm, slab.z_b[0]
    return _image_sum(frequency, slab, l, -l - 2.0 * top)


def transmittance_hankel(frequency: ArrayLike, slab: Slab) -> Floats:
    """Hankel transform of T(r) by frequency [1/mm], closed as above, (n, c) [-]."""
    l, top, d = slab.source_mm, slab.z_b[0], slab.layer.thickness_mm
    if np.isinf(d):
        return np.zeros((*np.shape(frequency), len(l)))
    return _image_sum(frequency, slab, d - l, d + l + 2.0 * top)


def reflectance(radius_mm: ArrayLike, slab: Slab, tolerance: float = 1e-8) -> Floats:
    """R(r) per power that entered, (n, c) [1/mm2].

    radius_mm : (n,) distances [mm]
    tolerance : bound of the light in the images left out, as a share of what entered [-]

    Source: [DonnerJensen2005] eq. 2-6.
    """
    if np.isinf(slab.layer.thickness_mm):
        return dipole.reflectance(radius_mm, slab.layer, slab.A_top)
    l, top = slab.source_mm, slab.z_b[0]
    return _series(radius_mm, slab, lambda shift: (l + shift, shift - l - 2.0 * top), tolerance)


def transmittance(radius_mm: ArrayLike, slab: Slab, tolerance: float = 1e-8) -> Floats:
    """T(r) per power that entered, (n, c) [1/mm2].

    A source that was moved onto the lower face sends half its light straight out: that spike at r = 0 is in
    `transmittance_hankel` alone.

    Source: [DonnerJensen2005] eq. 7, 8.
    """
    l, top, d = slab.source_mm, slab.z_b[0], slab.layer.thickness_mm
    if np.isinf(d):
        return np.zeros((*np.shape(radius_mm), len(l)))
    return _series(radius_mm, slab, lambda shift: (d - l - shift, d + l + 2.0 * top - shift), tolerance)


def _image_sum(frequency: ArrayLike, slab: Slab, real: Floats, image: Floats) -> Floats:
    """Half the albedo times the sum over i of the signed exp(-|z + i P| q) of a real source less an image."""
    q = np.sqrt(slab.layer.sigma_tr**2 + np.asarray(frequency, dtype=np.float64)[..., None] ** 2)
    P = slab.period_mm

    def images(z: Floats) -> Floats:
        z0 = np.mod(z, P)  # the series is odd and periodic: two geometric ones
        return np.asarray((np.exp(-z0 * q) - np.exp(-(P - z0) * q)) / -np.expm1(-P * q))

    return np.asarray(0.5 * slab.layer.alpha_prime * (images(real) - images(image)))


def _series(
    radius_mm: ArrayLike, slab: Slab, pair: Callable[[Floats], tuple[Floats, Floats]], tolerance: float
) -> Floats:
    result = np.zeros((*np.shape(radius_mm), len(slab.source_mm)))
    for i in range(-(n := pairs_needed(slab, tolerance)), n + 1):
        real, image = pair(i * slab.period_mm)
        result += dipole.flux(radius_mm, real, slab.layer.sigma_tr)
        result -= dipole.flux(radius_mm, image, slab.layer.sigma_tr)
    return np.asarray(slab.layer.alpha_prime * result)


def pairs_needed(slab: Slab, tolerance: float, most: int = 2000) -> int:
    """Images on each side that keep the light of all the others below `tolerance` [-].

    The light of an image at depth z is exp(-|z| sigma_tr) / 2, so what is left out is at most a geometric
    series. Without absorption that never ends; but then the images come in opposite pairs whose
    flux per area falls as the inverse cube of their distance, and `most` of them leave 1e-7 of the first.
    """
    decay = float((slab.period_mm * slab.layer.sigma_tr).min())
    if decay <= 0.0:
        return most
    left = np.log(4.0 / (tolerance * -np.expm1(-decay)))
    return int(min(most, np.ceil(left / decay) + 2))


@dataclass(frozen=True)
class Response:
    """Hankel transforms, (n, c) each, of what a stack does to light from above and from below [-]."""

    R_above: Floats
    T_down: Floats
    R_below: Floats
    T_up: Floats

    def over(self, lower: Response) -> Response:
        """This stack on top of another.

        Source: [DonnerJensen2005] section 3.3, after Kubelka's addition of layers.
        """
        between = 1.0 / (1.0 - self.R_below * lower.R_above)
        return Response(
            self.R_above + self.T_down * lower.R_above * between * self.T_up,
            self.T_down * between * lower.T_down,
            lower.R_below + lower.T_up * self.R_below * between * lower.T_down,
            lower.T_up * between * self.T_up,
        )


def respond(frequency: ArrayLike, medium: Medium, A: float, clamp: Clamp = "layer") -> Response:
    """The response of all layers by frequency s [1/mm].

    A : boundary mismatch against the air, above and below; inner faces are index-matched [-]
    clamp : where the source of a layer thinner than a mean free path goes, see `Slab`
    """
    slabs = slabs_of(medium, A, clamp)
    stack = _one(frequency, slabs[-1])
    for slab in reversed(slabs[:-1]):
        stack = _one(frequency, slab).over(stack)
    return stack


def slabs_of(medium: Medium, A: float, clamp: Clamp = "layer") -> list[Slab]:
    """The medium's layers with their faces."""
    last = len(medium.layers) - 1
    return [
        Slab(layer, A if i == 0 else 1.0, A if i == last else 1.0, clamp)
        for i, layer in enumerate(medium.layers)
    ]


def _one(frequency: ArrayLike, slab: Slab) -> Response:
    R, T = reflectance_hankel(frequency, slab), transmittance_hankel(frequency, slab)
    if np.isinf(slab.layer.thickness_mm):  # nothing comes from below
        return Response(R, T, np.zeros_like(R), np.zeros_like(R))
    below = slab.flipped()
    return Response(R, T, reflectance_hankel(frequency, below), transmittance_hankel(frequency, below))
