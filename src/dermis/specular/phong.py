"""Phong's highlight around the mirror direction, as first published and with its energy put right."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.specular.blinn_phong import exponent
from dermis.specular.cosines import Cosines, Floats
from dermis.specular.fresnel import Fresnel, schlick
from dermis.specular.models import Model


def phong(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """BRDF with the factor (s + 2) / 2 pi that has it reflect F at normal incidence [1/sr].

    m : roughness; s is a quarter of `exponent(m)`, for the mirror direction turns twice as far as h

    Source: [LafortuneWillems1994], with Fresnel's reflectance on v.h, which keeps it reciprocal.
    """
    s = 0.25 * exponent(m)
    lobe = fresnel(angles.v_h) * (s + 2.0) / (2.0 * np.pi) * _power(angles, s)
    return np.asarray(np.where(angles.above, lobe, 0.0))


def phong_plain(angles: Cosines, m: ArrayLike, fresnel: Fresnel = schlick) -> Floats:
    """The highlight W(i) cos^s of 1975 as a BRDF: divided by the cosine that it does not have [1/sr].

    W(i) is Fresnel's reflectance at the angle of incidence. That and the division make it not reciprocal. It
    was added to a diffuse term without 1/pi; both are divided by pi here.

    Source: [Phong1975].
    """
    n_l = np.maximum(angles.n_l, 1e-6)
    lobe = fresnel(n_l) * _power(angles, 0.25 * exponent(m)) / (np.pi * n_l)
    return np.asarray(np.where(angles.above, lobe, 0.0))


def _power(angles: Cosines, s: Floats) -> Floats:
    """(r.v)^s with r the mirrored light."""
    r_v = 2.0 * angles.n_l * angles.n_v - (2.0 * angles.v_h**2 - 1.0)
    return np.asarray(np.clip(r_v, 0.0, 1.0) ** s)


PHONG = Model(
    phong,
    "a power of the mirror direction with its energy put right",
    reciprocal=True,
    sources=("Phong1975", "LafortuneWillems1994"),
)
PHONG_PLAIN = Model(
    phong_plain,
    "a power of the mirror direction as first published; not reciprocal, for its highlight has no cosine "
    "of the light and its reflectance is that of the angle of incidence",
    reciprocal=False,
    sources=("Phong1975",),
)
