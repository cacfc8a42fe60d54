"""Hair outside the skin: twenty people, and every style."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tolerances import KNOTS_INSIDE_SKIN

from dermis.apps.validation.people.hair_penetration import hair_penetration, with_style
from dermis.human.hair.look import HAIR_STYLES
from dermis.human.person import Human

LIMIT_MM = 0.5
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
    assert sum(one.inside for one in found) <= KNOTS_INSIDE_SKIN * sum(one.knots for one in found)


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
