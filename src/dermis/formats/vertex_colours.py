"""Colours of vertices as files store them: sRGB, from 0 to 1 or from 0 to 255."""

from __future__ import annotations

import numpy as np

from dermis.base.arrays import Doubles, Numbers
from dermis.images.colour import decode_srgb


def linear_colours(stored_colours: Numbers) -> tuple[Doubles, list[str]]:
    """Convert vertex colours of a file to linear colours (n, 3) from 0 to 1; also return notes for users.

    stored_colours : (n, 3) sRGB; integers are divided by the largest value of their type; floats are divided
        by 255 if any float is larger than 1; NaN becomes 1
    """
    notes = []
    if stored_colours.dtype.kind in "iu":
        scale = float(np.iinfo(stored_colours.dtype.str).max)
    else:
        largest = np.fmax.reduce(stored_colours, axis=None, initial=0.0)
        scale = 255.0 if largest > 1 else 1.0
        if largest > 1:
            notes.append(f"colours of vertices run to {largest:g}: they are read as levels from 0 to 255")
    colours = np.nan_to_num(stored_colours.astype(np.float64) / scale, nan=1.0, posinf=np.inf, neginf=-np.inf)
    outside = np.count_nonzero(((colours < 0) | (colours > 1)).any(axis=1))
    if outside:
        notes.append(f"colours of {outside} vertices are out of range and are clamped")
    return np.asarray(decode_srgb(np.clip(colours, 0.0, 1.0))), notes
