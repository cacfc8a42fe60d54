"""Monte Carlo results as targets of fits."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from dermis.optics.fits.targets import RingTarget


@pytest.fixture(scope="session")
def counted(sample_folder: Path) -> Callable[[str], RingTarget]:
    """Return a function from a case such as "dj3/g0.8" to its rings in three channels, per incident power."""
    stored = np.load(sample_folder / "reference" / "data" / "mc_profiles.npz")

    def rings(case: str) -> RingTarget:
        name, g = case.split("/")
        keys = [f"{name}_{channel}_{g}" for channel in "RGB"]
        edges = stored[f"{keys[0]}/edges"]
        area = np.pi * np.diff(edges**2)[:, None]
        energy = area * np.stack([stored[f"{key}/R"] for key in keys], axis=1)
        return RingTarget(edges, energy, energy.sum(axis=0))

    return rings


@pytest.fixture(scope="session")
def counted_skin(counted: Callable[[str], RingTarget]) -> RingTarget:
    """Return the rings of skin1 with isotropic scattering."""
    return counted("skin1/g0")
