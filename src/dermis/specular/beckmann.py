"""The Beckmann distribution of microfacet slopes, and the table that the shader reads."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

TABLE_SIZE = 512
_EXPONENT = 0.1


def beckmann(cos_h: ArrayLike, m: ArrayLike) -> NDArray[np.float64]:
    """exp(-tan^2 / m^2) / (m^2 cos^4), without the 1/pi of a normalised distribution [-].

    cos_h : cosine between normal and half vector
    m : roughness, the root mean square slope

    Source: [Beckmann1963], in the form of [dEonLuebke2007] section 14.3.
    """
    c = np.clip(np.asarray(cos_h, dtype=np.float64), 1e-4, 1.0)
    m2 = np.asarray(m, dtype=np.float64) ** 2
    tan2 = (1.0 - c**2) / c**2
    value: NDArray[np.float64] = np.exp(-tan2 / m2) / (m2 * c**4)
    return value


@cache
def beckmann_table(size: int = TABLE_SIZE) -> NDArray[np.float32]:
    """(size, size) of beckmann(x, y)^0.1 / 2: columns cos_h from 0 to 1, rows m at texel centres.

    The last column is cos_h = 1 itself: a table of texel centres would cut the highlight's peak off.

    The power flattens the peak so that interpolation between texels stays close; decoded as (2 t)^10.
    Source: [dEonLuebke2007] section 14.3.
    """
    cos_h = np.arange(size) / (size - 1)
    m = (np.arange(size) + 0.5) / size
    with np.errstate(under="ignore"):
        table = 0.5 * beckmann(cos_h[None, :], m[:, None]) ** _EXPONENT
    return table.astype(np.float32)
