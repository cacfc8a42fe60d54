"""Limits of picture sizes, checked in headers before any pixel is decoded."""

from __future__ import annotations

MAX_FILE_BYTES = 256 << 20
"""Largest size of a picture file [byte]."""
MAX_PIXELS = 8192**2
"""Largest number of pixels of a picture: the size of the largest texture that every device supports."""
MAX_TOTAL_PIXELS = 2 * MAX_PIXELS
"""Largest total number of pixels in the pictures of one mesh file."""


class TooLargeError(ValueError):
    """Error for a valid picture with too many pixels."""


def check_size(width: int, height: int) -> tuple[int, int]:
    """Return the width and height of a picture after checking that they are positive and not too large.

    Raises ValueError if there are no pixels, and TooLargeError if there are too many pixels.
    """
    if width < 1 or height < 1:
        raise ValueError(f"it has {width} x {height} pixels")
    if width * height > MAX_PIXELS:
        raise TooLargeError(f"it has {width} x {height}")
    return width, height
