"""Beckmann distribution of microfacet slopes, and its texture for the shader."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

BECKMANN_TABLE_SIDE = 512
_BECKMANN_TABLE_EXPONENT = 0.1


def beckmann(cos_h: ArrayLike, m: ArrayLike) -> NDArray[np.float64]:
    """Return the Beckmann distribution exp(-tan^2 / m^2) / (m^2 cos^4) without its factor 1/pi [-].

    cos_h : cosine of the angle between normal and half vector; the formula contains the cosine and the
        tangent of this angle
    m : roughness, the root mean square slope [-]

    Source: [Beckmann1963], in the form of [dEonLuebke2007] section 14.3.
    """
    c = np.clip(np.asarray(cos_h, dtype=np.float64), 1e-4, 1.0)
    m2 = np.asarray(m, dtype=np.float64) ** 2
    tan2 = (1.0 - c**2) / c**2
    value: NDArray[np.float64] = np.exp(-tan2 / m2) / (m2 * c**4)
    return value


@cache
def beckmann_table(table_side: int = BECKMANN_TABLE_SIDE) -> NDArray[np.float32]:
    """Return beckmann(cos_h, m)^0.1 / 2 as a table (table_side, table_side) for the shader.

    Row i is for the roughness m = (i + 1/2) / table_side. Along each row, cos_h increases from 0 to 1
    inclusive, so the table contains the peak of the highlight. The exponent 0.1 flattens the peak, which
    makes interpolation accurate. The shader recovers the distribution from a table value t as (2t)^10.

    Source: [dEonLuebke2007] section 14.3.
    """
    cos_h = np.arange(table_side) / (table_side - 1)
    m = (np.arange(table_side) + 0.5) / table_side
    with np.errstate(under="ignore"):
        table = 0.5 * beckmann(cos_h[None, :], m[:, None]) ** _BECKMANN_TABLE_EXPONENT
    return table.astype(np.float32)
