"""Spherical harmonics of panoramas, and their convolution with isotropic kernels."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complex = NDArray[np.complex128]
_KERNEL_QUADRATURE_NODES = 4096


def legendre_functions(cosine: Floats, degree: int, order_count: int) -> list[Floats]:
    """Return the associated Legendre functions up to `degree`, as one array for each order m.

    The array of order m has the shape (degree + 1 - m, n): a row for each degree from m to `degree`, and a
    column for each cosine. The functions are fully normalised: if a function is multiplied by exp(i m phi),
    the squared modulus of the product has integral 1 over the sphere. The functions are computed by
    recurrence in the degree [HolmesFeatherstone2002].

    cosine : (n,) cosines of the polar angle
    order_count : number of orders m, from 0
    """
    sine = np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
    table = np.zeros((order_count, degree + 1, *cosine.shape))
    table[0, 0] = np.sqrt(0.25 / np.pi)
    for m in range(1, order_count):
        table[m, m] = np.sqrt((2.0 * m + 1.0) / (2.0 * m)) * sine * table[m - 1, m - 1]
    for l in range(1, degree + 1):
        if l <= order_count:
            table[l - 1, l] = np.sqrt(2.0 * l + 1.0) * cosine * table[l - 1, l - 1]
        order = np.arange(min(l - 1, order_count), dtype=np.float64)[:, None]
        a = np.sqrt((4.0 * l * l - 1.0) / (l * l - order**2))
        b = np.sqrt(((l - 1.0) ** 2 - order**2) / (4.0 * (l - 1.0) ** 2 - 1.0))
        table[: len(order), l] = a * (cosine * table[: len(order), l - 1] - b * table[: len(order), l - 2])
    return [table[m, m:] for m in range(order_count)]


def analyse_panorama(radiance: Floats, degree: int) -> list[Complex]:
    """Return the spherical harmonic coefficients of a panorama, an array for each order m from 0 to `degree`.

    The array of order m has the shape (degree + 1 - m, c): a row for each degree from m to `degree`, and a
    column for each colour channel. Negative orders are omitted; they follow from the others, as radiance is
    real.

    radiance : (h, w, c) radiance of the panorama
    """
    height, width = radiance.shape[:2]
    weighted = radiance * (_row_weights(height) * 2.0 * np.pi / width)[:, None, None]
    around = np.fft.rfft(weighted, axis=1)
    table = _legendre_table(height, degree)
    return [
        _complex_product(table[m], around[:, m] * np.exp(-1j * m * _first_column_azimuth(width)))
        if m < around.shape[1]
        else np.zeros((degree + 1 - m, radiance.shape[2]), complex)
        for m in range(degree + 1)
    ]


def zonal_factors(kernel: Callable[[Floats], Floats], degree: int) -> Floats:
    """Return the factors (degree + 1,) by which convolution with a kernel multiplies harmonic coefficients.

    kernel : isotropic kernel as a function of the angle theta in 0..pi/2, taken as 0 beyond pi/2

    The factor of degree 0 is the integral of the kernel over the sphere.

    Source: the Funk-Hecke theorem, as in [RamamoorthiHanrahan2001].
    """
    theta = _kernel_angles()
    measure = np.pi**2 / _KERNEL_QUADRATURE_NODES * np.sin(theta)
    return np.asarray(_kernel_polynomials(degree) @ (kernel(theta) * measure))


def synthesise_panoramas(coefficients: list[Complex], degree_factors: Floats, height: int) -> Floats:
    """Return k panoramas (k, height, 2 height, c) from harmonic coefficients and k sets of factors.

    In each panorama, the coefficients of each degree are multiplied by the factor of this degree.

    coefficients : coefficients of the spherical harmonics, see `analyse_panorama`
    degree_factors : (k, degree + 1) factor for each panorama and degree, see `zonal_factors`
    """
    width, channels = 2 * height, coefficients[0].shape[1]
    count, degree = degree_factors.shape[0], degree_factors.shape[1] - 1
    table = _legendre_table(height, degree)
    around = np.zeros((height, width // 2 + 1, count, channels), complex)
    for m in range(min(degree, width // 2 - 1) + 1):
        scaled = (coefficients[m][:, None] * degree_factors.T[m:, :, None]).reshape(-1, count * channels)
        rows = _complex_product(table[m].T, scaled) * np.exp(1j * m * _first_column_azimuth(width))
        around[:, m] = rows.reshape(height, count, channels)
    return np.moveaxis(np.fft.irfft(around, width, axis=1) * width, 2, 0)


def _complex_product(real_matrix: Floats, complex_matrix: Complex) -> Complex:
    """Return the product of a real and a complex matrix, without converting the real matrix to complex."""
    return (real_matrix @ np.ascontiguousarray(complex_matrix).view(np.float64)).view(np.complex128)


@lru_cache(maxsize=2)  # sizes of input and output; at degree 112 a row takes 51 kB
def _legendre_table(height: int, degree: int) -> list[Floats]:
    """Return the associated Legendre functions of all orders at the polar angles of a panorama's rows."""
    return legendre_functions(_polar_cosines(height), degree, degree + 1)


@lru_cache(maxsize=1)
def _kernel_polynomials(degree: int) -> Floats:
    """Return the Legendre polynomials of degree 0 to `degree` at the n angles of `_kernel_angles`.

    The result has the shape (degree + 1, n); the polynomials are evaluated at the cosines of the angles.
    """
    (functions,) = legendre_functions(np.cos(_kernel_angles()), degree, order_count=1)
    return np.asarray(functions * np.sqrt(4.0 * np.pi / (2.0 * np.arange(degree + 1) + 1.0))[:, None])


def _kernel_angles() -> Floats:
    """Return the quadrature angles (n,) over which kernels are integrated: midpoints in 0..pi/2 [rad]."""
    return np.asarray(0.5 * np.pi * (np.arange(_KERNEL_QUADRATURE_NODES) + 0.5) / _KERNEL_QUADRATURE_NODES)


def _polar_cosines(height: int) -> Floats:
    return np.cos(np.pi * (np.arange(height) + 0.5) / height)


@lru_cache(maxsize=2)
def _row_weights(height: int) -> Floats:
    """Return the quadrature weight (h,) of each row of a panorama by Fejér's first rule.

    Unlike solid angles, these weights integrate harmonics of low degree exactly.
    """
    double_angle = 2.0 * np.pi * (np.arange(height) + 0.5) / height
    k = np.arange(1, height // 2 + 1)
    series = np.cos(np.outer(double_angle, k)) @ (2.0 / (4.0 * k**2 - 1.0))
    return np.asarray(2.0 / height * (1.0 - series))


def _first_column_azimuth(width: int) -> float:
    return 2.0 * np.pi * (0.5 / width - 0.5)
