"""Distribution of pigments in people's skin, as a mixture of normal distributions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from dermis.base.tables import float_columns, read_rows
from dermis.optics.media import Floats

PRIOR_NAMES = ("melanin", "blood", "oxygen", "epidermis_mm")
"""Parameters of `SkinPrior`, which uses the logarithm of each of them except oxygen."""
_OXYGEN_INDEX = PRIOR_NAMES.index("oxygen")
_MIN_PIGMENT_FRACTION = 1e-4
_COVARIANCE_COLUMNS = [f"{a}_{b}" for i, a in enumerate(PRIOR_NAMES) for b in PRIOR_NAMES[: i + 1]]
PRIOR_COLUMNS = ("weight", *PRIOR_NAMES, *_COVARIANCE_COLUMNS)
"""Columns of the table: weight, means, and lower triangle of the covariance of a normal distribution."""


@dataclass(frozen=True, eq=False)
class SkinPrior:
    """Joint distribution of four skin parameters, a mixture of k normal distributions.

    The parameters are melanin, blood, oxygen and the thickness of the epidermis (`PRIOR_NAMES`). In each
    normal distribution, the variables are oxygen itself and the logarithms of the other three parameters.

    weight : (k,) weights of the normal distributions, which sum to 1
    mean : (k, 4) means of the four variables
    covariance : (k, 4, 4) covariances of the four variables
    """

    weight: Floats
    mean: Floats
    covariance: Floats

    def moments(self, parameter_name: str) -> tuple[float, float]:
        """Return mean and standard deviation of a parameter's logarithm; for oxygen, of the value itself."""
        i = PRIOR_NAMES.index(parameter_name)
        mean = float(self.weight @ self.mean[:, i])
        second = float(self.weight @ (self.covariance[:, i, i] + self.mean[:, i] ** 2))
        return mean, float(np.sqrt(max(second - mean**2, 0.0)))

    def conditioned_on(self, melanin: float, blood: float) -> SkinPrior:
        """Return the distribution of skins with given fractions of melanin and blood [-]."""
        log_fractions = np.log(np.maximum([melanin, blood], _MIN_PIGMENT_FRACTION))
        weight, mean, covariance = [], [], []
        for w, m, C in zip(self.weight, self.mean, self.covariance, strict=True):
            gain = C[:, :2] @ np.linalg.inv(C[:2, :2])
            offset = log_fractions - m[:2]
            density = np.exp(-0.5 * offset @ np.linalg.solve(C[:2, :2], offset))
            weight.append(w * density / np.sqrt(np.linalg.det(C[:2, :2])))
            mean.append(m + gain @ offset)
            covariance.append(C - gain @ C[:2, :])
        weights = np.array(weight) + 1e-300
        return SkinPrior(weights / weights.sum(), np.array(mean), np.array(covariance))

    def sample(self, skin_count: int, seed: int = 0) -> dict[str, Floats]:
        """Return parameters of random skins: a dictionary from each of `PRIOR_NAMES` to values (skin_count,).

        Oxygen is clipped to the range from 0 to 1.
        """
        rng = np.random.default_rng(seed)
        component = rng.choice(len(self.weight), size=skin_count, p=self.weight)
        values, vectors = np.linalg.eigh(self.covariance)
        roots = vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :]
        points = self.mean[component] + np.einsum(
            "nij,nj->ni", roots[component], rng.standard_normal((skin_count, len(PRIOR_NAMES)))
        )
        columns = {name: np.exp(points[:, i]) for i, name in enumerate(PRIOR_NAMES) if i != _OXYGEN_INDEX}
        return columns | {"oxygen": np.clip(points[:, _OXYGEN_INDEX], 0.0, 1.0)}


@cache
def skin_prior() -> SkinPrior:
    """Return the distribution of pigments in an archive of measured skin, over all people and body sites.

    Source: [Lu2025] for the spectra, which the package's skin model converts to pigments.
    """
    rows = read_rows("dermis.optics", "data/skin_priors")
    count = len(PRIOR_NAMES)
    lower = float_columns(rows, " ".join(_COVARIANCE_COLUMNS))
    covariance = np.zeros((len(rows), count, count))
    i, j = np.tril_indices(count)
    covariance[:, i, j] = covariance[:, j, i] = lower
    mean = float_columns(rows, " ".join(PRIOR_NAMES))
    return SkinPrior(float_columns(rows, "weight")[:, 0], mean, covariance)


def prior_points(parameter_values: dict[str, Floats]) -> Floats:
    """Return the parameters of n skins as points (n, 4) in the coordinates of `SkinPrior`.

    The coordinates are oxygen itself and the logarithms of the other three parameters, in the order of
    `PRIOR_NAMES`.

    parameter_values : dictionary from the name of each parameter (`PRIOR_NAMES`) to its values (n,)
    """
    columns = [np.log(np.maximum(parameter_values[name], _MIN_PIGMENT_FRACTION)) for name in PRIOR_NAMES]
    columns[_OXYGEN_INDEX] = parameter_values["oxygen"]
    return np.stack(columns, axis=-1)
