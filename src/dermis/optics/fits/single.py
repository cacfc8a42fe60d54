"""The one Gaussian nearest to a profile: what a single blur of the light map can do."""

from __future__ import annotations

import numpy as np

from dermis.optics.gaussians import GaussianSum


def single_gaussian(profile: GaussianSum) -> GaussianSum:
    """One Gaussian for all channels with each channel's total, of least squares over the plane.

    Its width follows light maps that were blurred once [Borshukov2003; Green2004].
    """
    from scipy.optimize import minimize_scalar

    def at(log_variance: float) -> GaussianSum:
        return GaussianSum(f"{profile.name}, one blur", np.exp([log_variance]), profile.albedo[None])

    def misfit(log_variance: float) -> float:
        one = at(log_variance)
        return float((one.inner(one) - 2 * one.inner(profile)).sum())

    ends = np.log(profile.variance_mm2[[0, -1]])
    return at(minimize_scalar(misfit, bounds=(ends[0] - 1e-6, ends[1] + 1e-6), method="bounded").x)
