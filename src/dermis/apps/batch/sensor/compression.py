"""Compression of pictures by JPEG."""

from __future__ import annotations

import io

import numpy as np

from dermis.base.arrays import Bytes


def jpeg_round_trip(picture: Bytes, quality: int) -> Bytes:
    """Return a picture (h, w, 3) of sRGB bytes after compression and decoding, as a viewer shows it.

    Colour differences have half the resolution (4:2:0), as in pictures by phones.

    quality : 1 to 100, on the scale of libjpeg

    Source: [Wallace1992].
    """
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=quality, subsampling="4:2:0")
    return np.array(Image.open(file))
