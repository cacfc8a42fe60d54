"""Where light comes back that enters at a slant: around a place beside where it entered."""

from __future__ import annotations

import numpy as np

from dermis.optics.media import Medium

_ABSORBED = 0.35  # of absorption in the published length


def aside_mm(body: Medium) -> float:
    """How far from where it entered the middle of light lies that came along the surface, the channels' mean.

    body : of one layer

    Light from an angle lies its sine times that far from there, on along its way.

    Source: [WangJacques1995].
    """
    layer = body.layers[0]
    return float(np.mean(1.0 / (layer.sigma_s_prime + _ABSORBED * layer.sigma_a)) / body.eta)
