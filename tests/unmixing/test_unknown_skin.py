"""Priors of people's skin, and deviations of pigments whose oxygen and thickness are assumed."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.apps.inverse.unmixing.skin_model import skin_model, solve_pigments
from dermis.apps.inverse.unmixing.unknown_skin import sd_from_assumed_parameters
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.optics.pigments.priors import PRIOR_NAMES, prior_points, skin_prior
from dermis.optics.pigments.spectra import rgb_weights
from dermis.optics.skin_spectra import skin_reflectance


def test_samples_have_the_moments_of_the_prior() -> None:
    prior = skin_prior()
    points = prior_points(prior.sample(40_000))
    assert prior.weight.sum() == pytest.approx(1.0, abs=1e-4)
    for i, name in enumerate(PRIOR_NAMES):
        mean, sd = prior.moments(name)
        limit = 0.02 if name != "oxygen" else 0.06  # which is clipped
        assert points[:, i].mean() == pytest.approx(mean, abs=limit), name
        assert points[:, i].std() == pytest.approx(sd, rel=0.15), name


def test_known_pigments_narrow_the_prior() -> None:
    given = skin_prior().conditioned_on(0.06, 0.008)
    mean, sd = given.moments("melanin")
    assert (mean, sd) == pytest.approx((np.log(0.06), 0.0), abs=1e-3)
    assert given.moments("epidermis_mm")[1] < 0.8 * skin_prior().moments("epidermis_mm")[1]


def test_two_thirds_of_people_are_within_one_stated_deviation() -> None:
    """Other people of the prior than those from which the deviations are computed."""
    true = skin_prior().sample(400, seed=7)
    spectra = skin_reflectance(
        true["melanin"],
        true["blood"],
        oxygen=true["oxygen"],
        eumelanin_fraction=DEFAULT_SKIN.eumelanin,
        epidermis_mm=true["epidermis_mm"],
        baseline=DEFAULT_SKIN.baseline,
    )
    found = solve_pigments(skin_model(), spectra @ rgb_weights().T)
    inside = {"melanin": [], "blood": []}
    for k in range(len(spectra)):
        values = {"melanin": float(found.melanin[k]), "blood": float(found.blood[k])}
        stated = sd_from_assumed_parameters(**values)
        for name, value in values.items():
            error = np.log(max(value, 1e-4) / true[name][k])
            inside[name].append(abs(error) <= stated[name])
    assert {name: 0.6 < np.mean(one) < 0.8 for name, one in inside.items()} == {
        "melanin": True,
        "blood": True,
    }


def test_known_parameters_leave_less_deviation() -> None:
    nothing = sd_from_assumed_parameters(0.05, 0.01)
    thickness = sd_from_assumed_parameters(0.05, 0.01, known_parameters=["epidermis_mm"])
    assert thickness["melanin"] < 0.5 * nothing["melanin"] and thickness["blood"] < nothing["blood"]
    everything = sd_from_assumed_parameters(0.05, 0.01, known_parameters=["epidermis_mm", "oxygen"])
    assert everything == {"melanin": 0.0, "blood": 0.0}
