"""Spherical harmonics of specular and isotropic lobes, with the normal of the plane of incidence as pole.

Lobes are symmetric about this plane, so half of the harmonics vanish; n is the number of harmonics that
remain.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.environment.harmonics import legendre_functions
from dermis.environment.prefilter import LAYER_ROUGHNESSES, isotropic_lobe_factors
from dermis.specular.cosines import cosines
from dermis.specular.models import Lobe

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
_FIT_DEGREES = (40, 80, 128)
"""Highest degrees of harmonics that fits choose from; narrow lobes need a high degree."""
_MIN_DEGREE_TIMES_WIDTH = 10.0  # least product of a fit's degree and the lobe's deviation across the plane
_SKY_POWER_FALLOFF = 1.0  # exponent by which light falls with the degree: 0 for lamps, 2 for smooth light
_DEGREE_1_WEIGHT = 10.0  # additional weight of degree 1, which determines the mean direction
_NODES_ALONG_INCIDENCE, _NODES_ACROSS_INCIDENCE = (
    160,
    40,
)  # quadrature nodes along the plane of incidence and across
_LEGENDRE_TABLE_STEP_RADIANS = np.radians(0.25)  # step of the tabulated angles from the plane


class LobeTarget(NamedTuple):
    """Specular lobe of unit integral for one roughness and view angle, to which isotropic lobes are fitted.

    degree : highest degree of the spherical harmonics
    coefficients : (n,) coefficients of the harmonics that `harmonic_terms` lists
    mean_angle : angle between the mean direction of the lobe and the surface normal [rad]
    along_deviation : standard deviation of the angle in the plane of incidence [rad]
    across_deviation : standard deviation of the sine of the angle from the plane of incidence [-]
    """

    degree: int
    coefficients: Complex
    mean_angle: float
    along_deviation: float
    across_deviation: float


class IsotropicLobes(NamedTuple):
    """Parameters of five isotropic lobes, (5,) each.

    angle : angle between the normal and the projection of the lobe's axis onto the plane of incidence [rad]
    out_of_plane : angle between the lobe's axis and the plane of incidence [rad]
    log_roughness : logarithm of the roughness
    weight : weights, which sum to 1
    """

    angle: Floats
    out_of_plane: Floats
    log_roughness: Floats
    weight: Floats


def lobe_target(lobe: Lobe, view_cosine: float, roughness: float) -> LobeTarget:
    """Expand a specular lobe in spherical harmonics, to which isotropic lobes are then fitted.

    view_cosine : cosine of the angle between view direction and surface normal
    roughness : roughness m of the surface [-]

    The quadrature covers one side of the plane of incidence, as the lobe is symmetric about this plane.
    """
    t = (np.arange(_NODES_ACROSS_INCIDENCE) + 0.5) / _NODES_ACROSS_INCIDENCE
    widest = min(10.0 * roughness + 0.05, 0.5 * np.pi)
    out_of_plane, steps = widest * t**2, 2.0 * widest * t / _NODES_ACROSS_INCIDENCE  # denser near the plane
    mirror, reach = np.arccos(view_cosine), 12.0 * roughness + 0.1
    low, high = max(mirror - reach, -0.5 * np.pi), min(mirror + reach, 0.5 * np.pi)
    angles = low + (high - low) * (np.arange(_NODES_ALONG_INCIDENCE) + 0.5) / _NODES_ALONG_INCIDENCE
    a, y = np.meshgrid(angles, out_of_plane, indexing="ij")
    light = np.stack([np.sin(a) * np.cos(y), np.sin(y), np.cos(a) * np.cos(y)], axis=-1)
    view = np.array([-np.sqrt(1.0 - view_cosine**2), 0.0, view_cosine])
    with np.errstate(under="ignore"):
        weight = (
            lobe(cosines(np.array([0.0, 0.0, 1.0]), light, view), roughness)
            * light[..., 2]
            * np.cos(y)
            * steps
        )
    weight = weight / weight.sum()
    mean_angle = np.arctan2((weight * light[..., 0]).sum(), (weight * light[..., 2]).sum())
    along, across = (float(np.sqrt((weight * x**2).sum())) for x in (a - mean_angle, light[..., 1]))
    degree = min(
        (one for one in _FIT_DEGREES if one > _MIN_DEGREE_TIMES_WIDTH / across), default=_FIT_DEGREES[-1]
    )
    around = np.exp(-1j * np.outer(np.arange(degree + 1), angles)) @ weight
    order = harmonic_terms(degree)[1]
    coefficients = (around[order] * _legendre_at_quadrature_angles(roughness, degree)).sum(axis=1)
    return LobeTarget(degree, coefficients, float(mean_angle), along, across)


@cache
def harmonic_terms(degree: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """Return degree, order and weight of the n harmonics that are symmetric about the plane of incidence.

    The weights serve to compare two lobes by the light that each of them reflects from a randomly rotated
    environment. For each harmonic, the difference of the coefficients of the two lobes is multiplied by the
    weight. The sum of the squares of these products is the expected squared difference between the two
    reflections. The weight of degree 1 is larger than this rule requires, because degree 1 determines the
    mean direction of a lobe.

    degree : highest degree of the harmonics
    """
    pairs = [(l, m) for m in range(degree + 1) for l in range(m, degree + 1, 2)]
    degrees, orders = np.array(pairs, np.intp).T
    weight = np.sqrt(4.0 * np.pi * (degrees + 1.0) ** -_SKY_POWER_FALLOFF * np.where(orders > 0, 2.0, 1.0))
    weight[degrees == 1] *= _DEGREE_1_WEIGHT
    return degrees, orders, weight


def isotropic_sum_harmonics(lobes: IsotropicLobes, degree: int) -> tuple[Complex, Complex]:
    """Return the harmonic coefficients (n,) of a sum of isotropic lobes, and their derivatives (n, 4, 5).

    Each lobe is averaged with its mirror image in the plane of incidence. The axes of the derivatives are
    harmonic, parameter, and lobe. The parameters are `IsotropicLobes.angle`, `IsotropicLobes.out_of_plane`,
    the logarithm of the roughness, and the logarithm of the weight. The derivatives with respect to a weight
    keep the sum of all weights constant.
    """
    order = harmonic_terms(degree)[1]
    azimuthal = np.exp(-1j * np.outer(np.arange(degree + 1), lobes.angle))[order]
    polar, polar_slopes = _interpolate_legendre(degree, lobes.out_of_plane)
    factors, factor_slopes = np.stack(
        [_layer_convolution_factors(float(m), degree) for m in lobes.log_roughness], axis=-1
    )
    terms = factors * azimuthal * polar * lobes.weight
    total = terms.sum(axis=1)  # a matrix product would start BLAS threads, which take longer
    return total, np.stack(
        [
            -1j * order[:, None] * terms,
            factors * azimuthal * polar_slopes * lobes.weight,
            factor_slopes * azimuthal * polar * lobes.weight,
            terms - lobes.weight * total[:, None],
        ],
        axis=1,
    )


def _symmetric_legendre_functions(sine: Floats, degree: int) -> Floats:
    """Return the associated Legendre functions (n, k) of the harmonics that `harmonic_terms` lists.

    sine : (k,) sines of the angle from the plane of incidence, which are cosines of the polar angle
    degree : highest degree of the harmonics
    """
    return np.concatenate([rows[::2] for rows in legendre_functions(sine, degree, degree + 1)])


@cache
def _legendre_at_quadrature_angles(roughness: float, degree: int) -> Floats:
    """Return the associated Legendre functions (n, k) at k quadrature angles from the plane of incidence.

    roughness : roughness of the lobe, which determines the largest angle
    degree : highest degree of the harmonics
    """
    t = (np.arange(_NODES_ACROSS_INCIDENCE) + 0.5) / _NODES_ACROSS_INCIDENCE
    return _symmetric_legendre_functions(np.sin(min(10.0 * roughness + 0.05, 0.5 * np.pi) * t**2), degree)


@cache
def _legendre_table(degree: int) -> Floats:
    """Return the associated Legendre functions (k, n) at k angles from the plane of incidence.

    The angles increase from 0 to 90 degrees, where the pole of the harmonics is: the normal of the plane.

    degree : highest degree of the harmonics
    """
    return _symmetric_legendre_functions(
        np.sin(np.append(np.arange(0.0, 0.5 * np.pi, _LEGENDRE_TABLE_STEP_RADIANS), 0.5 * np.pi)), degree
    ).T.copy()


def _interpolate_legendre(degree: int, plane_angles: Floats) -> tuple[Floats, Floats]:
    """Interpolate the associated Legendre functions to k angles; return values and derivatives, (n, k) each.

    degree : highest degree of the harmonics
    plane_angles : (k,) angles from the plane of incidence [rad]
    """
    table, position = _legendre_table(degree), np.abs(plane_angles) / _LEGENDRE_TABLE_STEP_RADIANS
    low = np.minimum(position.astype(int), len(table) - 2)
    step = table[low + 1] - table[low]
    value = table[low] + (position - low)[:, None] * step
    return value.T, (np.where(plane_angles < 0.0, -1.0, 1.0)[:, None] * step / _LEGENDRE_TABLE_STEP_RADIANS).T


def _layer_convolution_factors(log_roughness: float, degree: int) -> Floats:
    """Return the factors by which convolution with a lobe multiplies n harmonic coefficients, (2, n).

    The first row contains the factors, interpolated between two layers of the prefiltered panorama as in the
    shader. The second row contains their derivatives with respect to the logarithm of the roughness.

    log_roughness : logarithm of the roughness of the lobe
    degree : highest degree of the harmonics
    """
    layers, degrees = np.log(LAYER_ROUGHNESSES), harmonic_terms(degree)[0]
    step = layers[1] - layers[0]
    position = np.clip((log_roughness - layers[0]) / step, 0.0, len(layers) - 1.0)
    low = min(int(position), len(layers) - 2)
    near, far = _layer_factor_table()[low : low + 2, degrees]
    return np.stack([near + (position - low) * (far - near), (far - near) / step])


@cache
def _layer_factor_table() -> Floats:
    """Return the factors (layers, degrees) by which prefiltering scales the harmonics of a panorama.

    Each layer of a prefiltered panorama is the panorama convolved with a lobe of one of the roughnesses
    `LAYER_ROUGHNESSES`. This convolution multiplies all spherical harmonics of a degree by one factor. Above
    the highest degree of the prefiltered panorama, the factors are 0.
    """
    kernels = np.stack([isotropic_lobe_factors(float(m)) for m in LAYER_ROUGHNESSES])
    return np.pad(kernels, ((0, 0), (0, max(_FIT_DEGREES[-1] + 1 - kernels.shape[1], 0))))
