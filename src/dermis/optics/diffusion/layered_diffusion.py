"""Diffusion in layered media, with continuous fluence and flux at each interface.

In the Hankel domain, the fluence phi(z) in each layer satisfies D phi'' - D q^2 phi = -S(z). Here, z is the
depth, D is the diffusion coefficient, and q^2 is sigma_tr^2 + s^2 at the frequency s. The source S(z) is the
power per unit of depth of light that scatters for the first time at the depth z.
For the light above an interface, all layers below this interface are equivalent to the boundary condition
D phi' = W - Z phi at the interface. Z and W are computed for one interface after another, from the lowest up
to the surface.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.media import Floats, Layer, Medium

SourceKind = Literal["beam", "point"]
_NEAR_ZERO_FREQUENCY = np.array([1e-8])  # so low that a Hankel transform equals the total reflectance [1/mm]


class _Sublayer(NamedTuple):
    """Layer, or one of the two parts of a divided layer, with the light source that it contains.

    layer : absorption and scattering; its field `thickness_mm` is ignored
    thickness_mm : thickness of the sublayer [mm]
    beam : fraction of the beam that reaches the upper face unscattered; 0 for a point source [-]
    point : power of the point source on the lower face; 0 for a beam [-]
    """

    layer: Layer
    thickness_mm: float | Floats
    beam: Floats  # fraction of the unscattered beam at its upper face
    point: Floats  # power of the point source on its lower face


class _BoundaryCondition(NamedTuple):
    """Boundary condition D phi' = W - Z phi of a face, with the fluence phi and the diffusion coefficient D.

    The derivative phi' is with respect to depth; Z and W depend on the layers below the face.
    """

    Z: Floats
    W: Floats


_NO_LIGHT = _BoundaryCondition(np.zeros(()), np.zeros(()))
"""Boundary condition below a semi-infinite layer, which has no effect."""


class _DownwardTransfer(NamedTuple):
    """Coefficients that give the fluence at the lower face of a sublayer from the fluence at its upper face.

    The fluence is a sum of three solutions of the diffusion equation: one decays downwards, one grows
    downwards, and a particular solution accounts for the source of light and is 0 at the upper face.

    E : attenuation exp(-q d) across the thickness d of the sublayer, where q is the rate of decay [-]
    rho : ratio of the growing to the decaying solution at the lower face, if there is no source [-]
    common : 1 / (1 + E^2 rho), which sums the reflections between both faces [-]
    beta : part of the growing solution at the lower face that the light sources cause; the other part is due
        to the decaying solution
    lower : particular solution at the lower face

    All coefficients are 0 for a semi-infinite sublayer. Only the last sublayer of a medium can be
    semi-infinite.
    """

    E: Floats | float = 0.0
    rho: Floats | float = 0.0
    common: Floats | float = 0.0
    beta: Floats | float = 0.0
    lower: Floats | float = 0.0

    def fluence_at_lower_face(self, fluence: Floats) -> Floats:
        across = self.E * (1.0 + self.rho) * self.common
        return np.asarray(fluence * across + (self.beta * (1.0 - self.E * across) + self.lower))


def solve_layers(
    frequency: ArrayLike, medium: Medium, boundary_mismatch: float, source_kind: SourceKind = "beam"
) -> tuple[Floats, Floats]:
    """Return the Hankel transforms (n, c) of R(r) and of T(r) of a layered medium [-].

    R(r) and T(r) are the profiles at the upper and the lower face, relative to the power that enters.

    frequency : (n,) frequencies s > 0 [1/mm]
    boundary_mismatch : boundary mismatch with air; internal interfaces are index-matched [-]
    source_kind : where light scatters for the first time. For "beam", this is anywhere along the beam, and
        R(r) diverges logarithmically at r = 0; for "point", it is at a depth of one mean free path, and R(r)
        is finite

    Source: [Haskell1994] for the boundary, [Kienle1998] for layers, [Farrell1992] for the beam.
    """
    return _solve_sublayers(frequency, _sublayers(medium, source_kind), medium.channels, boundary_mismatch)


def solve_reflectance(
    frequency: ArrayLike, medium: Medium, boundary_mismatch: float, source_kind: SourceKind = "beam"
) -> Floats:
    """Return the Hankel transform (n, c) of R(r) of a layered medium [-].

    R(r) is relative to the power that enters the medium. This function is faster than `solve_layers`, which
    also computes T(r).

    frequency : (n,) frequencies s > 0 [1/mm]
    boundary_mismatch : boundary mismatch with air [-]
    source_kind : where light first scatters: along the refracted beam ("beam") or at one depth ("point"),
        see `solve_layers`
    """
    return _solve_upwards(frequency, _sublayers(medium, source_kind), medium.channels, boundary_mismatch)[
        0
    ] / (2.0 * boundary_mismatch)


def solve_two_layers(
    upper_layer: Layer, thickness_mm: ArrayLike, lower_layer: Layer, boundary_mismatch: float
) -> Floats:
    """Return the total reflectance (n, c) of n skins with two layers, relative to the entering power [-].

    upper_layer : upper layers, with coefficients (n, c), or (c,) if they are the same for all skins
    thickness_mm : (n, 1) thicknesses of the upper layers, or one number [mm]
    lower_layer : semi-infinite lower layers, with coefficients (n, c) or (c,)
    boundary_mismatch : boundary mismatch with air [-]
    """
    d = np.asarray(thickness_mm, dtype=np.float64)
    ones = np.ones(np.shape(upper_layer.sigma_a)[-1])
    beam = np.exp(-upper_layer.sigma_t_prime * d)
    sublayers = [
        _Sublayer(upper_layer, d, ones, 0.0 * ones),
        _Sublayer(lower_layer, np.inf, beam, 0.0 * ones),
    ]
    return _solve_upwards(_NEAR_ZERO_FREQUENCY, sublayers, len(ones), boundary_mismatch)[0] / (
        2.0 * boundary_mismatch
    )


def two_layer_table(
    upper_layers: Layer, thickness_mm: float, lower_layers: Layer, boundary_mismatch: float
) -> Floats:
    """Return the total reflectance (n, m, c) of skins for each pair of n upper and m lower layers [-].

    The result is relative to the entering power, and the same as that of `solve_two_layers`. This function is
    several times faster for tables, because it computes exponentials only once per layer.

    upper_layers : upper layers, with coefficients (n, c); their absorption must not be 0
    thickness_mm : thickness of all upper layers [mm]
    lower_layers : semi-infinite lower layers, with coefficients (m, c)
    boundary_mismatch : boundary mismatch with air [-]
    """
    zero, ones = np.zeros(()), np.ones(upper_layers.sigma_a.shape[-1])
    below, _ = _propagate_up(zero, _Sublayer(lower_layers, np.inf, ones, 0.0 * ones), _NO_LIGHT)
    D, d, sigma_t = upper_layers.D, thickness_mm, upper_layers.sigma_t_prime
    q = upper_layers.sigma_tr
    E, beam, flux = np.exp(-q * d), np.exp(-sigma_t * d), D * q
    # particular solution that is 0 at the upper face: slope there, then value and slope at the lower face
    source = upper_layers.sigma_s_prime / D
    slope = source / (sigma_t + q)
    lower = source * _lower_value(sigma_t, q, d)
    lower_slope = slope * E - sigma_t * lower
    # W / (1 + 2 A Z) of the upper face as a fraction; both parts are linear in Z and W of the lower layers
    numerator = D * slope * flux * (1.0 + E**2) - 2.0 * flux * E * D * lower_slope
    numerator_by_Z = D * slope * (1.0 - E**2) - 2.0 * flux * E * lower
    numerator_by_W = 2.0 * flux * E * beam
    denominator = flux * (1.0 + E**2) + 2.0 * boundary_mismatch * flux**2 * (1.0 - E**2)
    denominator_by_Z = (1.0 - E**2) + 2.0 * boundary_mismatch * flux * (1.0 + E**2)
    result = numerator_by_Z[:, None] * below.Z
    result += numerator_by_W[:, None] * below.W
    result += numerator[:, None]
    result /= denominator_by_Z[:, None] * below.Z + denominator[:, None]
    return result


def solve_homogeneous_slabs(
    frequency: ArrayLike, layer: Layer, thickness_mm: Floats, boundary_mismatch: float
) -> tuple[Floats, Floats]:
    """Return the Hankel transforms (n, m, c) of R(r) and of T(r) of n slabs of one material [-].

    frequency : (m,) frequencies s > 0 [1/mm]
    layer : absorption and scattering of the slabs; its field `thickness_mm` is ignored
    thickness_mm : (n,) thicknesses of the slabs [mm]
    boundary_mismatch : boundary mismatch with air [-]
    """
    ones = np.ones(len(layer.sigma_a))
    sublayer = _Sublayer(layer, thickness_mm[:, None, None], ones, np.zeros_like(ones))
    return _solve_sublayers(frequency, [sublayer], len(ones), boundary_mismatch)


def _solve_sublayers(
    frequency: ArrayLike, sublayers: list[_Sublayer], channel_count: int, boundary_mismatch: float
) -> tuple[Floats, Floats]:
    """Return the Hankel transforms (n, channel_count) of R(r) and of T(r) of a stack of sublayers [-].

    frequency : (n,) frequencies s > 0 [1/mm]
    sublayers : the sublayers, topmost first
    boundary_mismatch : boundary mismatch with air [-]
    """
    fluence, transfers = _solve_upwards(frequency, sublayers, channel_count, boundary_mismatch)
    R = fluence / (2.0 * boundary_mismatch)
    for transfer in transfers:
        fluence = transfer.fluence_at_lower_face(fluence)
    return R, fluence / (2.0 * boundary_mismatch)


def _solve_upwards(
    frequency: ArrayLike, sublayers: list[_Sublayer], channel_count: int, boundary_mismatch: float
) -> tuple[Floats, list[_DownwardTransfer]]:
    """Return the fluence at the surface, and the `_DownwardTransfer` of each sublayer, topmost first.

    The arguments are those of `_solve_sublayers`.
    """
    s = np.asarray(frequency, dtype=np.float64)[..., None]
    zero = np.zeros((*s.shape[:-1], channel_count))
    face, transfers = (
        _BoundaryCondition(zero + 1.0 / (2.0 * boundary_mismatch), zero),
        list[_DownwardTransfer](),
    )
    for sublayer in reversed(sublayers):
        face, transfer = _propagate_up(s, sublayer, face)
        transfers.insert(0, transfer)
    return np.asarray(2.0 * boundary_mismatch * face.W / (1.0 + 2.0 * boundary_mismatch * face.Z)), transfers


def _propagate_up(
    frequency: Floats, sublayer: _Sublayer, lower_condition: _BoundaryCondition
) -> tuple[_BoundaryCondition, _DownwardTransfer]:
    """Propagate the boundary condition from the lower face of a sublayer to its upper face.

    frequency : (n, 1) frequencies s [1/mm]
    lower_condition : boundary condition at the lower face

    Returns the boundary condition at the upper face, and the coefficients that transfer the fluence from the
    upper to the lower face.
    """
    layer, d = sublayer.layer, sublayer.thickness_mm
    D, sigma_t = layer.D, layer.sigma_t_prime
    q = np.sqrt(layer.sigma_tr**2 + frequency**2)
    source = layer.sigma_s_prime * sublayer.beam / D
    slope = source / (sigma_t + q)  # slope of the particular solution that is 0 at the upper face
    if np.all(np.isinf(d)):
        return _BoundaryCondition(D * q, D * slope), _DownwardTransfer()
    E = np.exp(-q * d)
    lower = source * _lower_value(sigma_t, q, d)
    lower_slope = slope * E - sigma_t * lower
    rho = (D * q - lower_condition.Z) / (D * q + lower_condition.Z)
    W = lower_condition.W + sublayer.point  # the flux jumps at a source on the face
    beta = (W - lower_condition.Z * lower - D * lower_slope) / (D * q + lower_condition.Z)
    common = 1.0 / (1.0 + E**2 * rho)
    face = _BoundaryCondition(
        D * q * (1.0 - E**2 * rho) * common, 2.0 * D * q * beta * E * common + D * slope
    )
    # phi at the lower face is a E + b + P, with a = (phi0 - beta E) common and b = a E rho + beta.
    return face, _DownwardTransfer(E, rho, common, beta, lower)


def _lower_value(sigma_t: Floats, q: Floats, thickness_mm: float | Floats) -> Floats:
    """Return the value at the lower face of the particular solution that is 0 at the upper face [mm2].

    The source is exp(-sigma_t z) at the depth z.

    q : attenuation of the fluence without a source [1/mm]
    """
    d, gap = thickness_mm, np.abs(sigma_t - q)
    near = np.where(gap * d < 1e-8, d, -np.expm1(-gap * d) / np.where(gap > 0.0, gap, 1.0))
    return np.asarray(np.exp(-np.minimum(q, sigma_t) * d) * near / (sigma_t + q))


def _sublayers(medium: Medium, source_kind: SourceKind) -> list[_Sublayer]:
    return list(_beam_source_sublayers(medium) if source_kind == "beam" else _point_source_sublayers(medium))


def _beam_source_sublayers(medium: Medium) -> Iterator[_Sublayer]:
    depth = np.zeros(medium.channels)
    for layer in medium.layers:
        yield _Sublayer(layer, layer.thickness_mm, np.exp(-depth), np.zeros(medium.channels))
        depth = depth + layer.sigma_t_prime * layer.thickness_mm


def _point_source_sublayers(medium: Medium) -> Iterator[_Sublayer]:
    """Yield two sublayers per layer.

    The layer that contains the point source is divided at the source, where the optical depth is 1. All other
    layers are divided in the middle, or at a depth of 1 mm if they are semi-infinite.
    """
    depth = np.zeros(medium.channels)
    zero = np.zeros(medium.channels)
    for i, layer in enumerate(medium.layers):
        d, sigma_t = layer.thickness_mm, layer.sigma_t_prime
        deep = depth + sigma_t * d >= 1.0
        # A thinner slab has its source in the middle of its last layer.
        has_source = (depth < 1.0) & (deep | (i == len(medium.layers) - 1))
        middle = 0.5 * d if np.isfinite(d) else 1.0
        above = np.where(has_source & deep, (1.0 - depth) / sigma_t, middle)
        yield _Sublayer(layer, above, zero, np.where(has_source, layer.alpha_prime, 0.0))
        yield _Sublayer(layer, d - above, zero, zero)
        depth = depth + sigma_t * d
