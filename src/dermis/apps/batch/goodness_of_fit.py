"""Goodness-of-fit tests of the sampled parameters in a data set against the distributions of its spec."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from math import sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc, kolmogorov, ndtr

from dermis.apps.batch import distributions
from dermis.apps.batch.distributions import Choice, Constant, Distribution
from dermis.apps.batch.index import open_index
from dermis.apps.batch.sampling import round_significant
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import NO_ENVIRONMENT
from dermis.human.expressions import expand_targets

MIN_P_VALUE = 1e-6
"""p-value below which a test fails."""
_MEAN_KOLMOGOROV_STATISTIC = sqrt(np.pi / 2) * np.log(2)  # mean of the Kolmogorov distribution
_QUANTILE_COUNT = 10_000  # quantiles from which the moments of a distribution are computed
_RELATIVE_ROUNDING_ERROR = 5e-6  # largest relative error of rounding to six digits
_MAX_LISTED_VALUES = 12  # largest number of texts per distribution in the table
_MIN_EXPECTED_COUNT = 5.0  # expected samples in a cell of the chi-square test; smaller cells are pooled

Array = NDArray[np.float64]
Samples = Sequence[float | str]


class FitTest(NamedTuple):
    """Result of testing the samples of a parameter against its distribution.

    parameter : name of the parameter
    sample_count : number of samples: one per image; for a parameter that describes a person, one per person
    expected : mean and standard deviation of the distribution; probability of each value if the parameter is
        categorical
    observed : mean and standard deviation of the samples; fraction of each value if categorical
    distance : Kolmogorov-Smirnov distance; if categorical, largest difference between the probability and the
        observed fraction of a value [-]
    expected_distance : mean distance for `sample_count` random samples of the distribution; 0 if only one
        value is possible [-]
    p_value : p-value of the Kolmogorov-Smirnov test, or of the chi-square test if categorical [-]
    """

    parameter: str
    sample_count: int
    expected: str
    observed: str
    distance: float
    expected_distance: float
    p_value: float

    @property
    def is_accepted(self) -> bool:
        """Return whether the p-value is at least `MIN_P_VALUE`."""
        return self.p_value >= MIN_P_VALUE


def fit_tests(dataset_folder: Path, spec: Spec) -> Iterator[FitTest]:
    """Yield a goodness-of-fit test of each parameter that is not constant, from a data set's index.

    A parameter that describes a person has one sample per person, for any number of images of that person;
    other parameters have one per moment or clip.

    Raises DermisError if there is no index.
    """
    with open_index(dataset_folder, "the statistics of a data set") as file:
        names = set(file.schema_arrow.names)
        first: NDArray[np.int64] | slice = slice(None)
        if "person.number" in names:  # rows of the first image of each person
            people = np.array(file.read(columns=["person.number"]).column(0).to_pylist(), np.int64)
            first = np.unique(people, return_index=True)[1]
        moments: NDArray[np.int64] | slice = slice(None)
        if spec.sequence.images > 1:  # rows of the first image of each moment
            numbers = np.array(file.read(columns=["number"]).column(0).to_pylist(), np.int64)
            moments = np.unique(numbers // spec.sequence.images, return_index=True)[1]
        for name, distribution in spec.distributions.items():
            column = _index_column(name)
            moves = spec.clip is not None and name.startswith("pose.")  # values are those of the frame
            if isinstance(distribution, Constant) or column not in names or moves:
                continue
            values = np.array(file.read(columns=[column]).column(0).to_pylist(), object)
            sampled = values[first] if name.startswith("person.") else values[moments]
            if present := [value for value in sampled if value is not None]:
                yield _parameter_test(name, distribution, present, spec)


def fit_test(parameter: str, distribution: Distribution, samples: Samples) -> FitTest:
    """Return the goodness-of-fit test of samples: Kolmogorov-Smirnov for numbers, chi-square for strings."""
    if any(isinstance(bound, str) for bound in distribution.support):
        return _categorical_test(
            parameter, value_probabilities(distribution), [str(value) for value in samples]
        )
    return _numeric_test(parameter, distribution, np.sort(np.array(samples, np.float64)))


def cumulative_probability(distribution: Distribution, numbers: Array, *, is_inclusive: bool) -> Array:
    """Return the cumulative probability of a numeric distribution at each number x.

    numbers : (n,) numbers x
    is_inclusive : whether to return P(X <= x) instead of P(X < x); these differ only if the distribution
        gives x itself a non-zero probability
    """
    match distribution:
        case Constant(value):
            return ((numbers >= float(value)) if is_inclusive else (numbers > float(value))).astype(
                np.float64
            )
        case distributions.Uniform(low, high, logarithmic):
            if logarithmic:
                low, high, numbers = np.log(low), np.log(high), np.log(np.maximum(numbers, low))
            return np.clip((numbers - low) / (high - low), 0.0, 1.0)
        case distributions.Normal(mean, sd):
            return np.asarray(ndtr((numbers - mean) / sd))
        case distributions.TruncatedNormal(mean, sd, low, high):
            z, first, last = ((one - mean) / sd for one in (np.clip(numbers, low, high), low, high))
            if first > 0:  # upper tails, as 1 minus the lower tail would cancel far above the mean
                return np.asarray((ndtr(-first) - ndtr(-z)) / (ndtr(-first) - ndtr(-last)))
            return np.asarray((ndtr(z) - ndtr(first)) / (ndtr(last) - ndtr(first)))
        case Choice(parts, weights):
            terms = (
                w * cumulative_probability(part, numbers, is_inclusive=is_inclusive)
                for part, w in zip(parts, weights, strict=True)
            )
            return np.asarray(sum(terms) / sum(weights))
    raise TypeError(f"{distribution} is not numeric")


def value_probabilities(distribution: Distribution) -> dict[str, float]:
    """Return the probability of each possible string of a categorical distribution."""
    if isinstance(distribution, distributions.FileChoice):
        return dict.fromkeys(distribution.names, 1.0 / len(distribution.names))
    if isinstance(distribution, Constant):
        return {str(distribution.value): 1.0}
    assert isinstance(distribution, Choice)
    weights = defaultdict[str, float](float)
    for part, weight in zip(distribution.values, distribution.weights, strict=True):
        for text, probability in value_probabilities(part).items():
            weights[text] += weight * probability
    total = sum(weights.values())
    return {text: weight / total for text, weight in weights.items() if weight}


def _parameter_test(parameter: str, distribution: Distribution, samples: Samples, spec: Spec) -> FitTest:
    if parameter != "background.kind" or NO_ENVIRONMENT not in spec.distributions["environment.name"].support:
        return fit_test(parameter, distribution, samples)
    replacement = {"environment": "gradient"}  # in images without an environment, see `Sampler.parameters`
    expected = defaultdict[str, float](float)
    for text, probability in value_probabilities(distribution).items():
        expected[replacement.get(text, text)] += probability
    return _categorical_test(
        parameter, expected, [replacement.get(str(value), str(value)) for value in samples]
    )


def _numeric_test(parameter: str, distribution: Distribution, sorted_samples: Array) -> FitTest:
    """Return the Kolmogorov-Smirnov test of the samples of a numeric parameter.

    sorted_samples : (n,) samples in ascending order, each of which was rounded to six significant digits
    """
    count, error = len(sorted_samples), _RELATIVE_ROUNDING_ERROR * np.abs(sorted_samples)
    up_to = np.searchsorted(sorted_samples, sorted_samples, "right") / count
    below = np.searchsorted(sorted_samples, sorted_samples, "left") / count
    above = up_to - cumulative_probability(distribution, sorted_samples + error, is_inclusive=True)
    under = cumulative_probability(distribution, sorted_samples - error, is_inclusive=False) - below
    distance = float(max(above.max(), under.max(), 0.0))
    probabilities = (np.arange(_QUANTILE_COUNT) + 0.5) / _QUANTILE_COUNT
    quantiles: Array = np.array([distribution.quantile(p) for p in probabilities.tolist()], np.float64)
    p_value = float(kolmogorov(sqrt(count) * distance))
    expected, observed = _format_moments(quantiles), _format_moments(sorted_samples)
    return FitTest(
        parameter,
        count,
        expected,
        observed,
        distance,
        float(_MEAN_KOLMOGOROV_STATISTIC / sqrt(count)),
        p_value,
    )


def _categorical_test(
    parameter: str, expected_probabilities: Mapping[str, float], sampled_values: Sequence[str]
) -> FitTest:
    """Return the chi-square test of the samples of a categorical parameter.

    expected_probabilities : probability of each value
    sampled_values : sampled values of the parameter
    """
    count, counts = len(sampled_values), Counter(sampled_values)
    distance = max(
        abs(counts[text] / count - expected_probabilities.get(text, 0.0))
        for text in {*expected_probabilities, *counts}
    )
    expected_distance = max(sqrt(2 / np.pi * p * (1 - p) / count) for p in expected_probabilities.values())
    p_value = (
        0.0
        if counts.keys() - expected_probabilities.keys()
        else _chi_square(expected_probabilities, counts, count)
    )
    probabilities = _format_probabilities(expected_probabilities)
    found = _format_probabilities({text: counts[text] / count for text in expected_probabilities})
    return FitTest(parameter, count, probabilities, found, distance, expected_distance, p_value)


def _format_probabilities(probabilities: Mapping[str, float]) -> str:
    return ", ".join(
        f"{text} {probabilities[text]:.3g}" for text in sorted(probabilities)[:_MAX_LISTED_VALUES]
    )


def _chi_square(
    probabilities: Mapping[str, float], observed_counts: Counter[str], sample_count: int
) -> float:
    """Return the p-value of a chi-square test of the samples of a categorical parameter.

    Values with few expected samples are pooled.

    probabilities : probability of each value
    observed_counts : number of samples of each value
    sample_count : total number of samples
    """
    cells = [
        (observed_counts[text], sample_count * p)
        for text, p in probabilities.items()
        if sample_count * p >= _MIN_EXPECTED_COUNT
    ]
    pooled = sample_count - sum(one for one, _ in cells), sample_count - sum(mean for _, mean in cells)
    if pooled[1] > _MIN_EXPECTED_COUNT or pooled[0]:
        cells.append(pooled)
    if len(cells) < 2:
        return 1.0
    statistic = sum((one - mean) ** 2 / max(mean, 1.0) for one, mean in cells)
    return float(chdtrc(len(cells) - 1, statistic))


def _format_moments(samples: Array) -> str:
    return f"{round_significant(float(samples.mean())):.5g}, {round_significant(float(samples.std())):.5g}"


def _index_column(parameter: str) -> str:
    """Return the name of the index column that holds a parameter's samples.

    A parameter that sets a left and a right morph target has two equal columns; the first is returned.
    """
    start, _, target = parameter.partition(".")
    return f"pose.{expand_targets([target])[0]}" if start == "pose" else parameter
