"""Default skin: results of one command with defaults are valid for others with defaults."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tolerances import UNMIXED

import dermis
from dermis.apps.inverse.fitting.inputs import fit_subject
from dermis.human.skin.look import SkinLook
from dermis.optics.pigments.parameters import DEFAULT_SKIN
from dermis.optics.tissue import load_tissue
from dermis.scene.people import skin_of

PIGMENTS = "melanin", "eumelanin", "blood", "oxygen", "epidermis_mm"


@pytest.mark.parametrize(("melanin", "blood"), [(0.02, 0.01), (0.1, 0.02)])
def test_a_colour_of_spectral_skin_is_unmixed_back(melanin: float, blood: float) -> None:
    colour = load_tissue("spectral", pigments={"melanin": melanin, "blood": blood}).profile().total
    found = dermis.unmix(np.broadcast_to(colour, (4, 4, 3)), noise=1e-3, adapter="cpu")
    assert found.melanin == pytest.approx(melanin, rel=UNMIXED)
    assert found.blood == pytest.approx(blood, rel=UNMIXED)


def test_tissue_people_and_fits_start_from_the_same_skin() -> None:
    assert load_tissue("spectral").parameters == DEFAULT_SKIN
    look = SkinLook()
    assert {name: getattr(look, name) for name in PIGMENTS} == {
        name: getattr(DEFAULT_SKIN, name) for name in PIGMENTS
    }
    person = dermis.Human(skin=look)
    own = skin_of(person).pigments
    assert own is not None and own.epidermis_mm == DEFAULT_SKIN.epidermis_mm
    fixed = fit_subject(dermis.Scene(person.head())).scene.skin.pigments
    assert fixed is not None and fixed.epidermis_mm == DEFAULT_SKIN.epidermis_mm


def test_fits_keep_the_thickness_of_the_person() -> None:
    person = dermis.Human(skin=SkinLook(epidermis_mm=0.08, oxygen=0.6))
    fixed = fit_subject(dermis.Scene(person.head())).scene.skin.pigments
    assert fixed is not None and (fixed.epidermis_mm, fixed.oxygen) == (0.08, 0.6)


def test_the_published_skins_keep_their_thickness() -> None:
    for name in ("light", "medium", "dark"):
        parameters = load_tissue(name).parameters
        assert parameters == replace(parameters, epidermis_mm=0.25, oxygen=0.75)  # type: ignore[type-var]
