"""OpenEXR pictures, of which the header is judged before pixels are decoded."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.images.sizes import MOST_PIXELS, TooLargeError, check_size

EXR_START = b"\x76\x2f\x31\x01"
_CHANNELS = ("RGBA", "RGB", "Y")
_NAMES = {1: "Y", 3: "RGB"}  # by channels
_MOST_NUMBERS = 3 * MOST_PIXELS  # in all channels of all parts: the library decodes all of them
_MOST_CHANNELS = 1024


def decode_exr(data: bytes) -> NDArray[np.float32]:
    """(H, W, 1, 3 or 4) of the channels Y, RGB or RGBA of an OpenEXR file.

    data : the whole file
    ValueError : there are no such channels, they are too large, or the data are damaged
    """
    import OpenEXR

    names = _judged(_header(data))
    file = OpenEXR.File(io.BytesIO(data), separate_channels=True)
    if not file.parts:
        raise ValueError("its pixels are cut off or damaged")
    channels = file.channels()
    image = np.empty((*channels[names[0]].pixels.shape, len(names)), np.float32)
    for place, name in enumerate(names):
        image[..., place] = channels[name].pixels
    return image


def exr_size(data: bytes) -> tuple[int, int]:
    """Width and height of an OpenEXR file whose header is judged; pixels are not decoded."""
    file = _header(data)
    _judged(file)
    return _size(file.parts[0].header["dataWindow"])


def _header(data: bytes) -> Any:
    import OpenEXR

    return OpenEXR.File(io.BytesIO(data), separate_channels=True, header_only=True)


def _judged(file: Any) -> str:
    """The names of the channels to take, where all that the library decodes with them is no more than may be.

    file : opened for its header alone
    """
    numbers = 0
    for part in file.parts:
        width, height = _size(part.header["dataWindow"])
        check_size(width, height)
        if "deep" in str(part.header.get("type", "")).lower():
            raise ValueError("it holds deep samples, not pixels")
        tiles = part.header.get("tiles")
        if tiles is not None:
            check_size(tiles.xSize, tiles.ySize)
        numbers += width * height * len(part.header["channels"])
    if not file.parts:
        raise ValueError("its header is cut off or damaged")
    if numbers > _MOST_NUMBERS:
        raise TooLargeError(f"all its channels have {numbers / 1e6:.0f} million numbers")
    channels = {channel.name: channel for channel in file.parts[0].header["channels"]}
    names = next((names for names in _CHANNELS if set(names) <= channels.keys()), None)
    if names is None or len(channels) > _MOST_CHANNELS:
        told = ", ".join(sorted(channels)[:20])
        raise ValueError(f"it has channels {told}, not R, G, B or Y")
    if any((channels[name].xSampling, channels[name].ySampling) != (1, 1) for name in names):
        raise ValueError("its channels are of several sizes")
    return names


def _size(window: Any) -> tuple[int, int]:
    low, high = ([int(value) for value in corner] for corner in window)
    return high[0] - low[0] + 1, high[1] - low[1] + 1


def encode_exr(picture: NDArray[np.floating[Any]]) -> bytes:
    """An OpenEXR file of (H, W, 1 or 3) float16 or float32, as the channels Y or R, G, B.

    Runs of equal bytes alone are compressed: pictures with noise pack no better otherwise, and slower.
    """
    import OpenEXR

    channels = {
        name: np.ascontiguousarray(picture[..., k]) for k, name in enumerate(_NAMES[picture.shape[2]])
    }
    header = {"compression": OpenEXR.RLE_COMPRESSION, "type": OpenEXR.scanlineimage}
    file = io.BytesIO()
    OpenEXR.File(header, channels).write(file)
    return file.getvalue()
