"""Largest sizes of pictures, checked in their headers before any pixel is decoded."""

from __future__ import annotations

MAX_FILE_BYTES = 256 << 20
"""Of a picture's file."""
MAX_PIXELS = 8192**2
"""Of a picture: a map of the largest side that a device must take, or a panorama of 11585 columns."""
MAX_TOTAL_PIXELS = 2 * MAX_PIXELS
"""Of all pictures that a mesh file names."""


class TooLargeError(ValueError):
    """A picture is sound, as far as its header tells, but larger than any may be."""


def check_size(width: int, height: int) -> tuple[int, int]:
    """The size, which is one and not too large.

    ValueError : it has no pixels; TooLargeError : it has too many
    """
    if width < 1 or height < 1:
        raise ValueError(f"it has {width} x {height} pixels")
    if width * height > MAX_PIXELS:
        raise TooLargeError(f"it has {width} x {height}")
    return width, height
