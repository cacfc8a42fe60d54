"""How a medium's profile is known to the techniques that are judged."""

from __future__ import annotations

from typing import Literal

from dermis.apps.truths.slab_mc import counted_profile
from dermis.optics.gaussians import GaussianSum
from dermis.optics.media import Medium
from dermis.optics.profiles import fit_radial
from dermis.optics.tissue import Tissue

ModelName = Literal["counted", "layered", "montecarlo"]
"""By tables of photons, by layered diffusion, or by photons one by one."""
_PHOTONS = 2_000_000  # a channel


def gaussians_of(body: Medium, model: ModelName | None = None) -> GaussianSum:
    """Six Gaussians for a medium.

    model : by default tables of photons where there are some, else layered diffusion

    Raises DermisError for a medium that has no tables.
    """
    if model == "montecarlo":
        return fit_radial(counted_profile(body, photons=_PHOTONS), body.name)
    return fit_radial(Tissue(body).profile(model), body.name)
