"""What Babylon.js makes of a diffusion profile: its own few samples, as a curve.

By the shader subSurfaceScattering of babylonjs 9.28.0 and 9.34.0. A profile is a colour c. Samples are drawn
from the lobe of width max(c), on a spiral, and weighted by Burley's lobe with S = c, so that a channel's
width is 1/c. Half a pixel is taken for a pixel, so that all of it is twice as wide as metersPerUnit says.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from dermis.optics.curve import Curve
from dermis.optics.media import Floats

SAMPLES = 40
"""Of a pixel, where the lobe covers 160 pixels or more."""
TOO_WIDE = 2.0
"""Width on the screen over the one that metersPerUnit stands for."""
_GOLDEN = 1.618033988749895


def spiral(colour: ArrayLike, samples: int = SAMPLES) -> tuple[Floats, Floats, Floats]:
    """Radii (n,) and angles (n,) [rad] of the samples, and weights (n, 3) that add up to 1.

    Radii are in mm where the screen's scale is that of metersPerUnit and would be right.
    """
    s = np.asarray(colour, np.float64)
    i = np.arange(samples)
    radius, area = drawn((i + 0.5) / samples)
    width = float(s.max())
    r = width * radius[:, None]
    weight = s * (np.exp(-r * s / 3.0) + np.exp(-r * s)) * (area * width)[:, None]
    return r[:, 0], 2.0 * np.pi * ((i / _GOLDEN) % 1.0), weight / weight.sum(axis=0)


def drawn(share: ArrayLike) -> tuple[Floats, Floats]:
    """Radii within which shares of a lobe of width 1 lie, and 1 / (r pdf(r)) there, which weights go with."""
    u = 1.0 - np.asarray(share, np.float64)
    g = 1.0 + 4.0 * u * (2.0 * u + np.sqrt(1.0 + 4.0 * u * u))
    n = g ** (-1.0 / 3.0)
    c = 1.0 + g * n * n + n
    return 3.0 * np.log(c / (4.0 * u)), c**3 / (4.0 * u * (c * c + 16.0 * u * u))


def spiral_curve(colour: ArrayLike, metres: float, energy: ArrayLike) -> Curve:
    """The curve of the samples over all directions of an edge, in a scene whose unit is a metre.

    metres : metersPerUnit
    """
    r, _, weight = spiral(colour)
    true_mm = TOO_WIDE * r / metres
    return Curve.of(lambda at: (at[:, None, None] >= true_mm[:, None]).astype(float)[..., 0] @ weight, energy)
