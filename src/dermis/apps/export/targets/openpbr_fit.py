"""Mean free paths for the walks that OpenPBR means, and what other readings make of them."""

from __future__ import annotations

import numpy as np

from dermis.apps.export.equivalent import homogeneous
from dermis.apps.export.lobe import fit_d, lobe
from dermis.apps.export.subject import Subject
from dermis.optics.curve import Curve
from dermis.optics.half_space import half_space
from dermis.optics.media import Floats, Layer
from dermis.optics.van_de_hulst import albedo_of_colour


def fitted_mm(subject: Subject) -> Floats:
    """(3,) mean free paths of the walk whose curve is nearest, at the colour that it is to have."""
    return homogeneous(subject.curve, subject.albedo, "walk").mfp_mm


def typed_mm(subject: Subject) -> Floats:
    """(3,) what tables print for tissue, the diffuse mean free path on its surface; d of the lobe for none.

    Source: 1 / sigma_tr of the lowest layer, [Jensen2001].
    """
    layer = lowest(subject)
    if layer is None:
        return fit_d(subject.curve)
    return np.asarray(1.0 / np.sqrt(3.0 * np.maximum(layer.sigma_a, 1e-9) * layer.sigma_t_prime))


def lowest(subject: Subject) -> Layer | None:
    """The lowest layer of tissue in three channels, None without one."""
    tissue = subject.tissue
    if tissue is None or tissue.rgb is not None or tissue.medium.channels != 3:
        return None
    return tissue.medium.layers[-1]


def walk(colour: Floats, mfp_mm: Floats, subject: Subject) -> Curve:
    """What a walk shows that finds its albedo from a colour by van de Hulst's formula.

    All light together is that of the subject, times what the formula is off by.
    """
    found = half_space("walk", albedo_of_colour(colour), mfp_mm)
    return found.with_energy(subject.curve.energy * found.energy / np.maximum(subject.albedo, 1e-9))


def profile_of_specification(mfp_mm: Floats, subject: Subject) -> Curve:
    """What a renderer shows that takes the lobe of MaterialX's specification: its d is the radius."""
    return lobe(mfp_mm, subject.curve.energy)
