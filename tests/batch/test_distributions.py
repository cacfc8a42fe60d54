"""Distributions: statistics of their samples, and invalid definitions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from dermis.apps.batch.distributions import Distribution, parse_distribution
from dermis.apps.batch.sampling import hashed_uniform, round_significant

COUNT = 5000
SHARES = [hashed_uniform(3, k, "tests") for k in range(COUNT)]
LIKE: list[tuple[Any, Any]] = [
    ({"uniform": [-2, 5]}, stats.uniform(-2, 7)),
    ({"log_uniform": [0.01, 10]}, stats.loguniform(0.01, 10)),
    ({"normal": [3, 0.5]}, stats.norm(3, 0.5)),
    ({"truncated": [0, 1, -0.5, 2]}, stats.truncnorm(-0.5, 2)),
    ({"truncated": [0, 1, 3, 6]}, stats.truncnorm(3, 6)),
    ({"truncated": [40, 18, 25, 85]}, stats.truncnorm(-15 / 18, 45 / 18, 40, 18)),
]
REFUSED: list[tuple[Any, str]] = [
    ({"uniform": [1, 1]}, "less than the upper"),
    ({"uniform": [1]}, "2 numbers"),
    ({"uniform": 1}, "2 numbers"),
    ({"uniform": [0, math.inf]}, "none beyond"),
    ({"uniform": [0, "1"]}, "none beyond"),
    ({"log_uniform": [0, 1]}, "above 0"),
    ({"normal": [0, 0]}, "deviation above 0"),
    ({"truncated": [0, -1, 0, 1]}, "deviation above 0"),
    ({"truncated": [0, 1, 2, 1]}, "less than the upper"),
    ({"truncated": [0, 1, 9, 10]}, "at least 1e-06"),
    ({"choice": []}, "values to choose"),
    ({"choice": "abc"}, "a list in choice"),
    ({"choice": [1, 2], "weights": [1]}, "as many weights"),
    ({"choice": [1, 2], "weights": [1, -1]}, "weights from 0"),
    ({"choice": [1, 2], "weights": [0, 0]}, "weights from 0"),
    ({"choice": [1, "a"]}, "either numbers or texts"),
    ({"choice": [{"choice": [1, 2]}]}, "a number, a text"),
    ({"weights": [1]}, "a number, a text"),
    ({"uniform": [0, 1], "normal": [0, 1]}, "a number, a text"),
    (True, "a number, a text"),
    (math.nan, "a number, a text"),
    ([1, 2], "a number, a text"),
    ({}, "a number, a text"),
]
NUMBERS = st.floats(-1e6, 1e6)
ABOVE = st.floats(1e-3, 1e5)
SIMPLE: st.SearchStrategy[Any] = st.one_of(
    NUMBERS,
    st.builds(lambda low, more: {"uniform": [low, low + more]}, NUMBERS, ABOVE),
    st.builds(lambda low, more: {"log_uniform": [low, low + more]}, ABOVE, ABOVE),
    st.builds(lambda mean, sd: {"normal": [mean, sd]}, NUMBERS, ABOVE),
    st.builds(lambda mean, sd: {"truncated": [mean, sd, mean - sd, mean + 2 * sd]}, NUMBERS, ABOVE),
)
ANY = SIMPLE | st.builds(
    lambda both: {"choice": [value for value, _ in both], "weights": [weight for _, weight in both]},
    st.lists(st.tuples(SIMPLE, ABOVE), min_size=1, max_size=4),
)


def drawn(told: Any) -> list[Any]:
    found = parse_distribution(told)
    return [found.quantile(share) for share in SHARES]


@pytest.mark.parametrize(("told", "law"), LIKE, ids=lambda one: str(one)[:40])
def test_samples_follow_the_stated_distribution(told: Any, law: Any) -> None:
    values = drawn(told)
    assert stats.kstest(values, law.cdf).pvalue > 0.01
    low, high = parse_distribution(told).support
    assert isinstance(low, float) and low <= min(values) and max(values) <= high


def test_choices_have_the_frequencies_of_their_weights() -> None:
    values = drawn({"choice": ["a", "b", "c"], "weights": [1, 0, 3]})
    assert "b" not in values
    assert values.count("a") / COUNT == pytest.approx(0.25, abs=0.02)


def test_choices_of_distributions_are_mixtures() -> None:
    values = np.array(drawn({"choice": [0, {"uniform": [1, 3]}], "weights": [1, 4]}))
    assert np.mean(values == 0) == pytest.approx(0.2, abs=0.02)
    assert stats.kstest(values[values > 0], stats.uniform(1, 2).cdf).pvalue > 0.01


def test_uniform_numbers_are_even_and_streams_independent() -> None:
    assert stats.kstest(SHARES, "uniform").pvalue > 0.01
    others = [hashed_uniform(3, k, "another") for k in range(COUNT)]
    assert abs(np.corrcoef(SHARES, others)[0, 1]) < 0.04
    assert (hashed_uniform(1, 2, "a"), hashed_uniform(0, 0, "person.seed")) == (
        0.7628581707482375,
        0.782964648251052,
    )


@pytest.mark.parametrize(("told", "said"), REFUSED, ids=lambda one: str(one)[:40])
def test_values_that_state_no_distribution_are_refused(told: Any, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        parse_distribution(told)


@given(ANY, st.floats(0, 1, exclude_min=True, exclude_max=True))
def test_samples_are_within_the_support_and_serialisation_round_trips(told: Any, share: float) -> None:
    found = parse_distribution(told)
    assert isinstance(found, Distribution)
    assert parse_distribution(found.spec_value()) == found
    low, high = min(found.support), max(found.support)  # type: ignore[type-var]
    assert low <= found.quantile(share) <= high  # type: ignore[operator]


@given(st.floats(-1e9, 1e9))
def test_six_significant_digits_are_preserved(value: float) -> None:
    assert round_significant(value) == pytest.approx(value, rel=5.1e-6)
    assert round_significant(round_significant(value)) == round_significant(value)
    assert str(round_significant(-0.0)) == "0.0"
