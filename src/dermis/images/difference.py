"""How different two colours look."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
_XYZ_OF_REC709 = np.array(
    [[0.4123908, 0.3575843, 0.1804808], [0.2126390, 0.7151687, 0.0721923], [0.0193308, 0.1191948, 0.9505322]]
)
_WHITE = _XYZ_OF_REC709.sum(axis=1)
_EDGE = 6.0 / 29.0


def lab(linear: ArrayLike) -> Floats:
    """CIE L*a*b* (..., 3) under D65 of linear Rec. 709 colours (..., 3)."""
    t = np.asarray(linear, np.float64) @ _XYZ_OF_REC709.T / _WHITE
    f = np.where(t > _EDGE**3, np.cbrt(t), t / (3.0 * _EDGE**2) + 4.0 / 29.0)
    X, Y, Z = np.moveaxis(f, -1, 0)
    return np.stack([116.0 * Y - 16.0, 500.0 * (X - Y), 200.0 * (Y - Z)], axis=-1)


def delta_e_2000(first: ArrayLike, second: ArrayLike) -> Floats:
    """CIEDE2000 (...) between linear Rec. 709 colours (..., 3); 1 is just seen side by side.

    Source: [Sharma2005].
    """
    (L1, a1, b1), (L2, a2, b2) = (np.moveaxis(lab(one), -1, 0) for one in (first, second))
    mean_chroma = 0.5 * (np.hypot(a1, b1) + np.hypot(a2, b2))
    stretch = 1.5 - 0.5 * _seventh(mean_chroma)
    C1, C2 = np.hypot(stretch * a1, b1), np.hypot(stretch * a2, b2)
    h1, h2 = (np.degrees(np.arctan2(b, stretch * a)) % 360.0 for a, b in ((a1, b1), (a2, b2)))
    grey = C1 * C2 == 0.0
    turn = np.where(grey, 0.0, (h2 - h1 + 180.0) % 360.0 - 180.0)
    apart = np.abs(h1 - h2) > 180.0
    hue = np.where(
        grey, h1 + h2, 0.5 * (h1 + h2) + np.where(apart, np.where(h1 + h2 < 360.0, 180.0, -180.0), 0.0)
    )
    L, C = 0.5 * (L1 + L2), 0.5 * (C1 + C2)
    lightness = (L2 - L1) / (1.0 + 0.015 * (L - 50.0) ** 2 / np.sqrt(20.0 + (L - 50.0) ** 2))
    chroma = (C2 - C1) / (1.0 + 0.045 * C)
    tint = 2.0 * np.sqrt(C1 * C2) * np.sin(np.radians(turn / 2.0)) / (1.0 + 0.015 * C * _hue_weight(hue))
    rotation = -np.sin(np.radians(60.0 * np.exp(-(((hue - 275.0) / 25.0) ** 2)))) * 2.0 * _seventh(C)
    return np.asarray(np.sqrt(lightness**2 + chroma**2 + tint**2 + rotation * chroma * tint))


def _seventh(chroma: Floats) -> Floats:
    return np.asarray(np.sqrt(chroma**7 / (chroma**7 + 25.0**7)))


def _hue_weight(hue: Floats) -> Floats:
    terms = ((-0.17, 1.0, -30.0), (0.24, 2.0, 0.0), (0.32, 3.0, 6.0), (-0.20, 4.0, -63.0))
    return np.asarray(
        1.0 + sum(share * np.cos(np.radians(times * hue + shift)) for share, times, shift in terms)
    )
