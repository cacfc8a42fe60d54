"""Hair outside the skin: twenty people, and every style."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dermis.apps.validation.people.hair_penetration import (
    LIMIT_MM,
    device_hair_penetration,
    hair_penetration,
    with_style,
)
from dermis.frame.renderer import Renderer
from dermis.human.hair.look import HAIR_STYLES
from dermis.human.person import Human

PEOPLE = 20


def test_hair_of_twenty_people_in_all_styles_is_outside_their_skin() -> None:
    """Each person wears one of the styles; each style is worn at least once."""
    styles = HAIR_STYLES[1:]
    found = [
        hair_penetration(
            with_style(Human.sampled(seed), styles[seed % len(styles)]), LIMIT_MM, max_strands=600
        )
        for seed in range(PEOPLE)
    ]
    assert len(styles) <= PEOPLE
    assert all(one.knots > 300 for one in found)
    assert [one.inside for one in found] == [0] * PEOPLE


@pytest.mark.parametrize("style", ["long", "twists"])
def test_hair_that_the_device_grows_is_outside_the_skin(style: str) -> None:
    found = device_hair_penetration(Renderer(), with_style(Human.sampled(1), style), LIMIT_MM)
    assert found.knots > 10_000 and found.inside == 0


def test_hair_through_the_head_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Guides that are mirrored at the centre of the head run through it."""
    from dermis.apps.validation.people import hair_penetration as module

    original = module.grow_strands

    def through(*arguments: object) -> object:
        strands = original(*arguments)  # type: ignore[arg-type]
        return replace(strands, knots_mm=strands.knots_mm * np.array([1.0, 1.0, -1.0], np.float32))

    monkeypatch.setattr(module, "grow_strands", through)
    found = hair_penetration(with_style(Human.sampled(1), "cropped"), LIMIT_MM, max_strands=300)
    assert found.inside > 0.5 * found.knots and found.deepest_mm > 2.0
