"""Command that fits the distribution of people's skin parameters and writes skin_priors.csv."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

from dermis.apps.inverse.unmixing.spectral_inversion import fit_skin
from dermis.apps.validation.spectral_archive import read_archive
from dermis.base.atomic_write import atomic_file
from dermis.base.console import print_lines
from dermis.human.skin.measured import SITES
from dermis.optics.media import Floats
from dermis.optics.pigments.priors import PRIOR_COLUMNS, PRIOR_NAMES, SkinPrior, prior_points

_MIXTURE_COMPONENTS = 3
_EM_ITERATIONS = 300
_CALLOUS_SITES = ("palm", "ring finger")
"""Sites with a thick stratum corneum, which is not part of the model."""
_CSV_HEADER = """# quantity: mixture of normal distributions of log melanin, log blood, oxygen and
#   log epidermis_mm
# unit: fractions [-], mm; weight, mean and lower triangle of the covariance
# source: [Lu2025], all sites but palm and fingers, inverted by spectrum with the package's model
# licence: CC BY 4.0
"""


def fit_priors() -> None:
    """Fit the distribution of people's skin parameters to measured spectra, and write skin_priors.csv."""
    archive = read_archive()
    living = archive.select_rows(~np.isin(archive.site, [SITES.index(name) for name in _CALLOUS_SITES]))
    fit = fit_skin(living.spectra, PRIOR_NAMES)
    prior = fit_mixture(prior_points(fit.values), _MIXTURE_COMPONENTS)
    path = Path(str(files("dermis.optics"))) / "data" / "skin_priors.csv"
    with atomic_file(path) as file:
        file.write_text(_CSV_HEADER + prior_csv(prior), encoding="utf-8")
    print_lines(*(f"{name}: {prior.moments(name)}" for name in PRIOR_NAMES))


def prior_csv(prior: SkinPrior) -> str:
    """Return the CSV text of a mixture distribution: column names, and one row per normal distribution."""
    lower = np.tril_indices(len(PRIOR_NAMES))
    lines = [",".join(PRIOR_COLUMNS)]
    for weight, mean, covariance in zip(prior.weight, prior.mean, prior.covariance, strict=True):
        lines.append(",".join(f"{one:.5g}" for one in (weight, *mean, *covariance[lower])))
    return "\n".join(lines) + "\n"


def fit_mixture(points: Floats, component_count: int) -> SkinPrior:
    """Fit a mixture of normal distributions by expectation maximisation.

    At the start, the points are sorted by their first coordinate and divided into groups of equal size, and
    one distribution is fitted to each group.

    points : (n, d) points
    component_count : number of distributions
    """
    count, dimensions = points.shape
    parts = np.argsort(np.argsort(points[:, 0])) * component_count // count
    share = np.eye(component_count)[parts]
    for _ in range(_EM_ITERATIONS):
        total = share.sum(axis=0)
        mean = share.T @ points / total[:, None]
        offset = points[:, None] - mean
        covariance = np.einsum("nk,nki,nkj->kij", share, offset, offset) / total[:, None, None]
        covariance += 1e-4 * np.eye(dimensions)
        weight = total / count
        scaled = np.einsum("nki,kij,nkj->nk", offset, np.linalg.inv(covariance), offset)
        log_density = np.log(weight) - 0.5 * (scaled + np.linalg.slogdet(covariance)[1])
        share = np.exp(log_density - log_density.max(axis=1, keepdims=True))
        share /= share.sum(axis=1, keepdims=True)
    order = np.argsort(mean[:, 0])
    return SkinPrior(weight[order], mean[order], covariance[order])
