"""References against each other, and against their limits without scattering."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from dermis.apps.truths.metrics import energy_ratio, relative_rmse
from dermis.apps.validation.comparisons.compare import comparison_subject
from dermis.apps.validation.comparisons.references import (
    ComparisonSubject,
    heat_equation_patch_reference,
    irradiance_samples,
    surface_integral,
)
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings

BALL = Head("ball", uv_sphere(60.0, 96, 48), Maps())
ADAPTER = os.environ.get("DERMIS_TEST_ADAPTER", "cpu")


@pytest.fixture(scope="module")
def stripe_subject() -> Iterator[ComparisonSubject]:
    """Return a narrow stripe of light in a close view."""
    settings = Settings(size=(64, 64), atlas=64, shadow_size=256)
    with comparison_subject(BALL, "laser", "ear", "skin1", settings, ADAPTER) as subject:
        yield subject


def with_variances(subject: ComparisonSubject, *variance_mm2: float) -> ComparisonSubject:
    """Return the subject with a profile of equal Gaussians of albedo 1."""
    weight = np.full((len(variance_mm2), 3), 1 / len(variance_mm2))
    return replace(subject, profile=GaussianSum("test", np.array(variance_mm2), weight))


def test_integral_without_scattering_equals_entering_light(stripe_subject: ComparisonSubject) -> None:
    """A coarser grid of samples, which misses parts of the stripe, would have an error of 7 %."""
    reference = surface_integral(with_variances(stripe_subject, 0.03**2), 0)
    plain = Settings(**(stripe_subject.settings.model_dump() | {"technique": "none", "samples": 1}))
    entered = (
        stripe_subject.renderer.draw(stripe_subject.scene, plain).linear() / stripe_subject.profile.albedo
    )
    assert relative_rmse(entered, reference.image, reference.mask).value < 0.03
    assert energy_ratio(entered, reference.image, reference.mask).value == pytest.approx(1.0, abs=0.003)


def test_heat_and_integral_agree_on_gently_curved_surfaces(stripe_subject: ComparisonSubject) -> None:
    """This includes a Gaussian so narrow that it is integrated by Euclidean distance."""
    subject = with_variances(stripe_subject, 0.2, 0.5)
    stripe = subject.scene.lights[0]
    lit_point = np.array(stripe.position) - 17.2 * np.array(stripe.direction)
    straight = surface_integral(subject, 0)
    heat = heat_equation_patch_reference(subject, tuple(lit_point), 12.0, irradiance_samples(subject))
    assert 100 < heat.mask.sum() < straight.mask.sum()
    assert relative_rmse(heat.image, straight.image, heat.mask).value < 0.01
    assert energy_ratio(heat.image, straight.image, heat.mask).value == pytest.approx(1.0, abs=0.002)
