"""Harmonics of a surface's lobe and of round lobes as shaders read them, about the plane of view's normal."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.environment.harmonics import legendre
from dermis.environment.prefilter import ROUGHNESSES, isotropic_kernel
from dermis.specular.cosines import cosines
from dermis.specular.models import Lobe

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
_DEGREES = (40, 80, 128)
_DEGREE_TIMES_WIDTH = (
    10.0  # over the lobe's width across: the degree up to which it is fitted, at most the last of these
)
_SKY_POWER_FALLOFF = (
    1.0  # by which a sky's power per harmonic falls with the degree: 0 for lamps, 2 for gradual light
)
_DEGREE_1_WEIGHT = 10.0  # times the weight of degree 1, so that the sum has the lobe's mean direction
_QUADRATURE_NODES = (160, 40)  # of the sum over a lobe, along the plane of view and across
_TABLE_STEP = np.radians(0.25)  # between the angles from the plane at which functions are tabulated


class LobeTarget(NamedTuple):
    """A lobe for one roughness and view, with light of 1 in all.

    degree : of its last harmonics
    coefficients : (n,) of its harmonics about the normal of the plane of view
    middle : angle of its mean direction from the surface's normal [rad]
    along, across : standard deviations along the plane [rad] and of the sine across it
    """

    degree: int
    coefficients: Complex
    mean_angle: float
    along_deviation: float
    across_deviation: float


class IsotropicLobes(NamedTuple):
    """Lobes in absolute terms, (5,) each.

    angle : from the normal, in the plane of view [rad]
    beside : from the plane of view [rad]
    rough : logarithm of the roughness
    weight : with the sum 1
    """

    angle: Floats
    out_of_plane: Floats
    log_roughness: Floats
    weight: Floats


def lobe_target(lobe: Lobe, cosine: float, m: float) -> LobeTarget:
    """A surface's lobe by the view's cosine and its roughness: a sum over one side; the other is alike."""
    t = (np.arange(_QUADRATURE_NODES[1]) + 0.5) / _QUADRATURE_NODES[1]
    widest = min(10.0 * m + 0.05, 0.5 * np.pi)
    out_of_plane, steps = widest * t**2, 2.0 * widest * t / _QUADRATURE_NODES[1]  # denser near the plane
    mirror, reach = np.arccos(cosine), 12.0 * m + 0.1
    low, high = max(mirror - reach, -0.5 * np.pi), min(mirror + reach, 0.5 * np.pi)
    angles = low + (high - low) * (np.arange(_QUADRATURE_NODES[0]) + 0.5) / _QUADRATURE_NODES[0]
    a, y = np.meshgrid(angles, out_of_plane, indexing="ij")
    light = np.stack([np.sin(a) * np.cos(y), np.sin(y), np.cos(a) * np.cos(y)], axis=-1)
    view = np.array([-np.sqrt(1.0 - cosine**2), 0.0, cosine])
    with np.errstate(under="ignore"):
        weight = lobe(cosines(np.array([0.0, 0.0, 1.0]), light, view), m) * light[..., 2] * np.cos(y) * steps
    weight = weight / weight.sum()
    mean_angle = np.arctan2((weight * light[..., 0]).sum(), (weight * light[..., 2]).sum())
    along_deviation, across_deviation = (
        float(np.sqrt((weight * x**2).sum())) for x in (a - mean_angle, light[..., 1])
    )
    degree = min(
        (one for one in _DEGREES if one > _DEGREE_TIMES_WIDTH / across_deviation), default=_DEGREES[-1]
    )
    around = np.exp(-1j * np.outer(np.arange(degree + 1), angles)) @ weight
    order = harmonic_terms(degree)[1]
    coefficients = (around[order] * _node_functions(m, degree)).sum(axis=1)
    return LobeTarget(degree, coefficients, float(mean_angle), along_deviation, across_deviation)


@cache
def harmonic_terms(degree: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """(n,) degrees, orders and weights of the harmonics that are alike on both sides of the plane.

    Their squares, weighted, are what a sky shows of a difference on average over its rotations.
    """
    pairs = [(l, m) for m in range(degree + 1) for l in range(m, degree + 1, 2)]
    degrees, orders = np.array(pairs, np.intp).T
    weight = np.sqrt(4.0 * np.pi * (degrees + 1.0) ** -_SKY_POWER_FALLOFF * np.where(orders > 0, 2.0, 1.0))
    weight[degrees == 1] *= _DEGREE_1_WEIGHT
    return degrees, orders, weight


def isotropic_sum(lobes: IsotropicLobes, degree: int) -> tuple[Complex, Complex]:
    """(n,) coefficients of the weighted sum of round lobes, averaged with its mirror image, and their slopes.

    The slopes (n, 4, 5) are by angle, beside, rough, and the logarithm of the weight, with the sum kept at 1.
    """
    order = harmonic_terms(degree)[1]
    turned = np.exp(-1j * np.outer(np.arange(degree + 1), lobes.angle))[order]
    upright, by_beside = _interpolated_functions(degree, lobes.out_of_plane)
    factors, by_rough = np.stack([_layer_factors(float(m), degree) for m in lobes.log_roughness], axis=-1)
    shares = factors * turned * upright * lobes.weight
    total = shares.sum(axis=1)  # for a product BLAS would start threads, which wait longer than they work
    return total, np.stack(
        [
            -1j * order[:, None] * shares,
            factors * turned * by_beside * lobes.weight,
            by_rough * turned * upright * lobes.weight,
            shares - lobes.weight * total[:, None],
        ],
        axis=1,
    )


def _plane_functions(sine: Floats, degree: int) -> Floats:
    """(n, k) Legendre functions of the terms at sines of the angle from the plane (k,)."""
    return np.concatenate([rows[::2] for rows in legendre(sine, degree, degree + 1)])


@cache
def _node_functions(m: float, degree: int) -> Floats:
    """Functions at the nodes across a lobe."""
    t = (np.arange(_QUADRATURE_NODES[1]) + 0.5) / _QUADRATURE_NODES[1]
    return _plane_functions(np.sin(min(10.0 * m + 0.05, 0.5 * np.pi) * t**2), degree)


@cache
def _function_table(degree: int) -> Floats:
    """(k, n) functions from the plane to the pole."""
    return _plane_functions(
        np.sin(np.append(np.arange(0.0, 0.5 * np.pi, _TABLE_STEP), 0.5 * np.pi)), degree
    ).T.copy()


def _interpolated_functions(degree: int, out_of_plane: Floats) -> tuple[Floats, Floats]:
    """(n, k) functions at angles from the plane (k,), alike on both sides, and their slopes."""
    table, position = _function_table(degree), np.abs(out_of_plane) / _TABLE_STEP
    low = np.minimum(position.astype(int), len(table) - 2)
    step = table[low + 1] - table[low]
    value = table[low] + (position - low)[:, None] * step
    return value.T, (np.where(out_of_plane < 0.0, -1.0, 1.0)[:, None] * step / _TABLE_STEP).T


def _layer_factors(log_roughness: float, degree: int) -> Floats:
    """(2, n) factors of the terms under a round lobe as the shader reads it, and their slopes by `log_roughness`.

    rough : logarithm of the roughness; between two layers the shader mixes both
    """
    layers, degrees = np.log(ROUGHNESSES), harmonic_terms(degree)[0]
    step = layers[1] - layers[0]
    position = np.clip((log_roughness - layers[0]) / step, 0.0, len(layers) - 1.0)
    low = min(int(position), len(layers) - 2)
    near, far = _layer_kernels()[low : low + 2, degrees]
    return np.stack([near + (position - low) * (far - near), (far - near) / step])


@cache
def _layer_kernels() -> Floats:
    """(layers, degrees) factors of the layers; none are beyond their last degree."""
    kernels = np.stack([isotropic_kernel(float(m)) for m in ROUGHNESSES])
    return np.pad(kernels, ((0, 0), (0, max(_DEGREES[-1] + 1 - kernels.shape[1], 0))))
