"""Short names for NumPy array types.

>>> points: Doubles = np.zeros((4, 3))
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]
Index = NDArray[np.int64]
Intp = NDArray[np.intp]
Bytes = NDArray[np.uint8]
Mask = NDArray[np.bool_]
Numbers = NDArray[np.number]
"""Array of integers or floats of any size."""
