"""Curves from which hair and clothing are made."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles


def smoothstep(low: float, high: float, x: Doubles) -> Doubles:
    """Return a smooth cubic transition of x from 0 at `low` to 1 at `high`; `low` may exceed `high`."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
