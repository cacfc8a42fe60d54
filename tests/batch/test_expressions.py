"""Expressions of data sets: names of blend shapes, and mixtures without opposing movements."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from dermis.apps.batch.sampling import expression_weights, hashed_uniform, load_movements, random_expression
from dermis.human.expressions import EXPRESSIONS, expand_targets
from dermis.human.person import Human

COUNT = 3000
OPPOSITES = (
    {"mouthSmile", "mouthFrown"},
    {"browDown", "browInnerUp"},
    {"eyeWide", "eyeSquint"},
    {"eyeWide", "eyeBlink"},
    {"jawLeft", "jawRight"},
    {"mouthLeft", "mouthRight"},
    {"mouthPucker", "mouthPress"},
)


def drawn(seed: int) -> dict[str, float]:
    return {name: one for name, one in random_expression(partial(hashed_uniform, seed, 0)).items() if one > 0}


def none(name: str) -> float:
    return 0.0


@pytest.fixture(scope="module")
def targets() -> set[str]:
    return {*Human().head(subdivide=0).targets}


def test_the_human_has_all_morph_targets_of_the_expressions(targets: set[str]) -> None:
    names = [name for weights in EXPRESSIONS.values() for name in weights]
    names += [name for part in load_movements().values() for one in part for name in one.target_weights]
    assert set(expand_targets(names)) <= targets
    assert expand_targets(["mouthSmile", "jawOpen", "mouthLeft"]) == (
        "mouthSmileLeft",
        "mouthSmileRight",
        "jawOpen",
        "mouthLeft",
    )


def test_probabilities_of_a_part_sum_to_less_than_one() -> None:
    for part in load_movements().values():
        assert 0 < sum(one.probability for one in part) < 1
        assert all(0 < one.max_weight <= 1 and 0 <= one.jaw_closing <= 1 for one in part)


def test_mixtures_contain_no_opposing_movements() -> None:
    found = [drawn(seed) for seed in range(COUNT)]
    assert not [one for one in found for pair in OPPOSITES if pair <= one.keys()]
    for name, probability in (("mouthSmile", 0.35), ("jawLeft", 0.04), ("browInnerUp", 0.35)):
        assert np.mean([name in one for one in found]) == pytest.approx(probability, abs=0.03)
    shut = [one["jawOpen"] for one in found if "jawOpen" in one and one.get("mouthPress", 0) > 0.45]
    free = [
        one["jawOpen"]
        for one in found
        if "jawOpen" in one and not {"mouthPress", "mouthRollLower"} & one.keys()
    ]
    assert shut and max(shut) < 0.15 < max(free)


def test_left_and_right_differ_only_by_the_asymmetry() -> None:
    smile = EXPRESSIONS["smile"]
    even = expression_weights(smile, 1.0, 0.0, 0.0, none)
    assert even["mouthSmileLeft"] == even["mouthSmileRight"] == smile["mouthSmile"]
    leaning = expression_weights(smile, 0.5, 0.2, 0.0, none)
    assert leaning["mouthSmileLeft"] == pytest.approx(0.6 * smile["mouthSmile"])
    assert leaning["mouthSmileRight"] == pytest.approx(0.4 * smile["mouthSmile"])
    middle = expression_weights({"jawOpen": 0.5, "mouthLeft": 0.5}, 1.0, 1.0, 0.0, none)
    assert middle == {"jawOpen": 0.5, "mouthLeft": 0.5}
    assert expression_weights({"mouthSmileLeft": 0.4}, 1.0, 0.5, 0.0, none) == {
        "mouthSmileLeft": pytest.approx(0.6)
    }


def test_weights_are_within_0_and_1() -> None:
    found = expression_weights({"jawOpen": 0.9, "browDown": 0.0}, 1.5, -1.0, 1.0, lambda name: 6.0)
    assert found == {"jawOpen": 1.0, "browDownLeft": 0.0, "browDownRight": 0.0}
