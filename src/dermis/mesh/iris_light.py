"""Light that an iris receives through the cornea, as polynomials of position and direction.

The cornea focuses light, most on the side of the iris opposite to an oblique light, and its far side faces
away from such light. tools/iris_light.py fits the polynomials to refracted rays.
"""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.tables import read_rows


def direct_terms(square: Doubles, offset: Doubles, cosine: Doubles) -> Doubles:
    """Return the terms (n, 13) of the polynomial for parallel light.

    square : (n,) squared distance from the axis, relative to the radius of the iris
    offset : (n,) product of the position, relative to the radius of the iris, and the direction to the light
    cosine : (n,) of the angle between the light and the axis
    """
    one, s, c = np.ones_like(square), offset, cosine
    even = [one, c, c * c, square, square * c, square**2, square**2 * c]
    odd = [s, s * square, s * c, s**2, s**2 * c, s**3]
    return np.stack([*even, *odd], axis=-1)


def iris_light_constants() -> dict[str, float]:
    """Return the coefficients as values that the shader preprocessor inserts into below_cornea.wgsl."""
    rows = read_rows("dermis.mesh", "iris_light")
    return {f"iris_{row['light']}_{row['term']}": float(row["coefficient"]) for row in rows}
