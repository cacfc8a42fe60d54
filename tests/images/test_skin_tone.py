"""Descriptions of skin colours, against published definitions."""

from __future__ import annotations

import numpy as np
import pytest

from dermis.images.colour import decode_srgb, lab
from dermis.images.skin_tone import SKIN_CLASS_DISCLAIMER, hue_degrees, ita_degrees, skin_tone


def test_ita_and_hue_follow_their_definitions() -> None:
    assert ita_degrees((60.0, 12.0, 10.0)) == pytest.approx(45.0)
    assert ita_degrees((50.0, 12.0, 15.0)) == pytest.approx(0.0)
    assert ita_degrees((35.0, 12.0, 15.0)) == pytest.approx(-45.0)
    assert ita_degrees((70.0, 5.0, -1.0)) == pytest.approx(90.0), "no wrap for blue colours"
    assert hue_degrees((60.0, 10.0, 10.0)) == pytest.approx(45.0)
    assert hue_degrees((60.0, 0.0, 10.0)) == pytest.approx(90.0)


@pytest.mark.parametrize(("code", "monk"), [("f6ede4", 1), ("d7bd96", 5), ("a07e56", 6), ("292420", 10)])
def test_colours_of_the_monk_scale_are_their_own_classes(code: str, monk: int) -> None:
    linear = decode_srgb(np.array([int(code[k : k + 2], 16) for k in (0, 2, 4)]) / 255.0)
    assert skin_tone(linear).monk == monk


@pytest.mark.parametrize(
    ("reflectance", "fitzpatrick"),
    [((0.62, 0.45, 0.36), "I"), ((0.50, 0.32, 0.22), "II"), ((0.12, 0.06, 0.035), "VI")],
)
def test_classes_follow_from_the_ita(reflectance: tuple[float, float, float], fitzpatrick: str) -> None:
    found = skin_tone(reflectance)
    assert found.fitzpatrick == fitzpatrick
    assert found.ita_degrees == pytest.approx(float(ita_degrees(lab(reflectance))))
    assert found.as_json()["statement"] == SKIN_CLASS_DISCLAIMER
    assert f"ITA {found.ita_degrees:.0f}" in found.as_text()
