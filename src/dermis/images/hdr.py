"""Decoding and encoding of OpenEXR and Radiance files; headers are checked before pixels are decoded."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Bytes, Doubles, Floats, Index
from dermis.base.errors import shorten
from dermis.base.file_properties import (
    drawn_property,
    drawn_property_with_note,
    markdown_code,
    noted_property,
    property_without_effect,
    refused_property,
)
from dermis.images.colour_spaces import SRGB, ColourSpace, gamma_colour_space
from dermis.images.exr_layers import ExrLayer, choose_layer
from dermis.images.header import PictureHeader, UnsupportedError
from dermis.images.sizes import MAX_PIXELS, TooLargeError, check_size

EXR_SIGNATURE = b"\x76\x2f\x31\x01"
_CHANNEL_NAMES_BY_COUNT = {1: "Y", 3: "RGB"}  # names of the channels by their number
_MAX_EXR_SAMPLES = 3 * MAX_PIXELS  # total of all channels and parts, because the library decodes all of them
_MAX_EXR_CHANNELS = 1024
_PIXEL_ASPECT_TOLERANCE = 1e-3
_MAX_CHANNEL_NAME_LENGTH = 60  # characters
Slices = tuple[slice, ...]
RADIANCE_SIGNATURE = b"#?"
_XYZ_FORMAT = b"FORMAT=32-bit_rle_xyze"
_RADIANCE_FORMATS = {b"FORMAT=32-bit_rle_rgbe", _XYZ_FORMAT}
_XYZ_PRIMARIES = np.array([1, 0, 0, 1, 0, 0, 1 / 3, 1 / 3])
_RADIANCE_HEADER_DEFAULTS = {
    "EXPOSURE": [1.0],
    "COLORCORR": [1.0] * 3,
    "PRIMARIES": [0.0] * 8,
    "GAMMA": [1.0],
    "PIXASPECT": [1.0],
}
"""Dictionary from the name of a variable in a Radiance header to the default values of its numbers; primaries
of 0 are unknown."""
_UNUSED_RADIANCE_HEADER_NAMES = ("GAMMA", "PIXASPECT")  # named in a note if they are not 1
EXR_PROPERTIES = (
    drawn_property("half, float, 32-bit integers; all kinds of compression; scan lines, tiles"),
    refused_property("deep pixels"),
    drawn_property("layer or part with R, G and B, in any case or in words, and perhaps A; or with Y"),
    noted_property(
        "several layers, such as `ViewLayer.Combined.R`, or parts",
        "the one without a name is read, else one called beauty, combined, rgba and the like, else the first",
    ),
    drawn_property("a single channel of any name", "as grey"),
    refused_property(
        "luminance with chroma (Y, RY, BY), subsampled channels, channels without a layer of colours"
    ),
    drawn_property_with_note("`dataWindow` inside `displayWindow`", "placed there, the rest is black"),
    drawn_property_with_note("`dataWindow` beyond `displayWindow`", "cut off"),
    drawn_property_with_note("`chromaticities`, else `colorInteropID`", "converted to Rec. 709"),
    noted_property("unknown `colorInteropID`"),
    noted_property("`pixelAspectRatio`", "no note if it is 1"),
    property_without_effect("`envmap`", "a cube is refused as a panorama by its shape"),
    property_without_effect("`screenWindow...`, `whiteLuminance`, cameras, dates, comments"),
)
"""Properties of OpenEXR files."""
RADIANCE_PROPERTIES = (
    drawn_property("`FORMAT` 32-bit_rle_rgbe"),
    drawn_property_with_note("`FORMAT` 32-bit_rle_xyze", "converted to Rec. 709"),
    refused_property("other `FORMAT`"),
    drawn_property("size: `-Y`, `+Y`, `-X`, `+X`, rows or columns first", "upright"),
    drawn_property("`EXPOSURE`, `COLORCORR`, also several", "pixels are divided by them"),
    drawn_property_with_note(
        "`PRIMARIES`", "converted to Rec. 709; zeros, as Photoshop writes them, are not used"
    ),
    noted_property(markdown_code(_UNUSED_RADIANCE_HEADER_NAMES), "no note if they are 1"),
    refused_property("run-length coding of before 1991"),
    property_without_effect("`VIEW`, `SOFTWARE`, comments"),
)
"""Properties of Radiance files (.hdr)."""
_MAX_RADIANCE_HEADER_BYTES = 1 << 16
_PIXELS_PER_STRIP = 1 << 18  # pixels decoded at a time
_MAX_LITERAL_RUN = 128  # codes up to this count literal bytes, larger codes are runs
_DECODED_BYTES_BY_RUN_CODE = [k if k <= _MAX_LITERAL_RUN else k - _MAX_LITERAL_RUN for k in range(256)]
"""Number of bytes to which each run-length code, from 0 to 255, is decoded."""
_ENCODED_BYTES_BY_RUN_CODE = [k + 1 if k <= _MAX_LITERAL_RUN else 2 for k in range(256)]
"""Number of bytes that each run-length code, from 0 to 255, takes in the file, including its data."""


def decode_exr(file_bytes: bytes) -> Floats:
    """Decode the picture in an OpenEXR file to an array (H, W, C) with 1, 3 or 4 channels.

    Pixels outside the data window are 0.

    Raises ValueError for a file without channels R, G, B or Y, and for a file that is too large or damaged.
    """
    import OpenEXR

    layer, _ = _checked_layer(_open_exr_header(file_bytes))
    parts = OpenEXR.File(io.BytesIO(file_bytes), separate_channels=True).parts
    if len(parts) <= layer.part:
        raise ValueError("its pixels are truncated or damaged")
    part = parts[layer.part]
    (width, height), stored, placed = _overlap_windows(part.header)
    image = np.zeros((height, width, len(layer.channels)), np.float32)
    for index, name in enumerate(layer.channels):
        image[..., index][placed] = part.channels[name].pixels[stored]
    return image


def exr_header(file_bytes: bytes) -> PictureHeader:
    """Return the header of an OpenEXR file; pixels are not decoded."""
    file = _open_exr_header(file_bytes)
    layer, layer_note = _checked_layer(file)
    header = file.parts[layer.part].header
    size, stored, placed = _overlap_windows(header)
    space, colour_note = _exr_colour_space(header)
    notes = [layer_note] if layer_note else []
    if not _covers_window(placed, size):
        notes.append("its data window is a part of its display window, and the rest is black")
    if not _covers_window(stored, _window_size(header["dataWindow"])):
        notes.append("its pixels outside its display window are left out")
    if abs((aspect := header.get("pixelAspectRatio", 1.0)) - 1.0) > _PIXEL_ASPECT_TOLERANCE:
        notes.append(f"its pixel aspect of {aspect:g} is not used")
    is_grey = len(layer.channels) == 1
    return PictureHeader(size, space, notes=tuple(notes), colour_note=colour_note, is_grey=is_grey)


def _exr_colour_space(header: Any) -> tuple[ColourSpace, str | None]:
    """Return the colour space of a part of an OpenEXR file, and a note unless it is linear Rec. 709."""
    import OpenEXR

    primaries, name = header.get("chromaticities"), header.get("colorInteropID", "")
    if primaries is None and name not in ("", "data", "unknown"):
        primaries = OpenEXR.colorInteropIDToChromaticities(name)
        if primaries is None:
            shown = shorten("".join(one for one in name if one.isprintable()), _MAX_CHANNEL_NAME_LENGTH)
            return (
                SRGB,
                f"its colour space, {shown}, is unknown, and its colours are taken as linear Rec. 709",
            )
    space = gamma_colour_space("", None, primaries)
    return space, None if space.is_default else "its colours are converted from its primaries to Rec. 709"


def _open_exr_header(file_bytes: bytes) -> Any:
    import OpenEXR

    return OpenEXR.File(io.BytesIO(file_bytes), separate_channels=True, header_only=True)


def _checked_layer(exr_file: Any) -> tuple[ExrLayer, str | None]:
    """Check the header of an OpenEXR file; return the layer to decode, and a note on layers that are ignored.

    The total size of all channels of the file is limited, because the library decodes all of them.

    exr_file : OpenEXR.File that was opened with header_only
    """
    samples, channel_count = 0, 0
    for part in exr_file.parts:
        width, height = _window_size(part.header["dataWindow"])
        check_size(width, height)
        if "deep" in str(part.header.get("type", "")).lower():
            raise UnsupportedError("it has deep samples, not pixels")
        tiles = part.header.get("tiles")
        if tiles is not None:
            check_size(tiles.xSize, tiles.ySize)
        samples += width * height * len(part.header["channels"])
        channel_count += len(part.header["channels"])
    if not exr_file.parts:
        raise ValueError("its header is truncated or damaged")
    if samples > _MAX_EXR_SAMPLES:
        raise TooLargeError(f"all its channels have {samples / 1e6:.0f} million numbers")
    if channel_count > _MAX_EXR_CHANNELS:
        raise UnsupportedError(f"it has {channel_count} channels")
    channels = [{one.name: one for one in part.header["channels"]} for part in exr_file.parts]
    layer, note = choose_layer(
        [(part.name() or "", list(names)) for part, names in zip(exr_file.parts, channels, strict=True)]
    )
    chosen = [channels[layer.part][name] for name in layer.channels]
    if any((one.xSampling, one.ySampling) != (1, 1) for one in chosen):
        raise UnsupportedError("its channels have different sizes")
    check_size(*_window_size(exr_file.parts[layer.part].header["displayWindow"]))
    return layer, note


def _overlap_windows(header: Any) -> tuple[tuple[int, int], Slices, Slices]:
    """Return the size of the display window, and the slices in which display and data window overlap.

    The slices (rows, columns) are returned twice: relative to the data window, then to the display window.
    """
    data, shown = (np.array(header[name], np.int64)[:, ::-1] for name in ("dataWindow", "displayWindow"))
    low, high = np.maximum(data[0], shown[0]), np.minimum(data[1], shown[1]) + 1
    if not (low < high).all():
        raise UnsupportedError("its data window is outside its display window")
    stored, placed = (tuple(map(slice, low - one[0], high - one[0])) for one in (data, shown))
    return _window_size(header["displayWindow"]), stored, placed


def _covers_window(window_slices: Slices, window_size: tuple[int, int]) -> bool:
    return tuple((one.start, one.stop) for one in window_slices) == ((0, window_size[1]), (0, window_size[0]))


def _window_size(exr_window: Any) -> tuple[int, int]:
    low, high = ([int(value) for value in corner] for corner in exr_window)
    return high[0] - low[0] + 1, high[1] - low[1] + 1


def encode_exr(picture: NDArray[np.floating]) -> bytes:
    """Encode a picture (H, W, C) of float16 or float32 as an OpenEXR file.

    A picture with one channel is stored as Y, a picture with three channels as R, G and B.

    The compression is run-length encoding. For noisy pictures, other methods are slower, and the files are
    no smaller.
    """
    import OpenEXR

    names = _CHANNEL_NAMES_BY_COUNT[picture.shape[2]]
    channels = {name: np.ascontiguousarray(picture[..., k]) for k, name in enumerate(names)}
    header = {"compression": OpenEXR.RLE_COMPRESSION, "type": OpenEXR.scanlineimage}
    file = io.BytesIO()
    OpenEXR.File(header, channels).write(file)
    return file.getvalue()


@dataclass(frozen=True)
class _RadianceHeader:
    """Header of a Radiance .hdr file.

    axes : direction in which scanlines follow each other, and direction of the pixels of a scanline, such as
        "-Y" and "+X"
    lengths : number of scanlines, and number of pixels per scanline
    values : dictionary from the name of a variable, such as EXPOSURE, to its numbers; if several lines state
        a variable, their numbers are multiplied
    is_xyz : whether the colours are CIE XYZ
    offset : byte at which the pixels start
    """

    axes: tuple[str, str]
    lengths: tuple[int, int]
    values: Mapping[str, Doubles]
    is_xyz: bool
    offset: int


def decode_radiance(file_bytes: bytes) -> Floats:
    """Decode a Radiance .hdr file to linear radiance (H, W, 3), divided by the exposures in the header.

    FFmpeg is not used, because FFmpeg accepts truncated files.

    Raises ValueError for a file that is truncated or damaged.
    """
    header = _parse_radiance_header(file_bytes)
    (height, width), offset = header.lengths, header.offset
    exposure, correction = header.values["EXPOSURE"], header.values["COLORCORR"]
    compressed = file_bytes[offset : offset + 4] == _scanline_marker(width) and 8 <= width < 32768
    if len(file_bytes) - offset < height * (4 if compressed else 4 * width):
        raise ValueError("it is truncated")
    radiance = np.empty((height, width, 3), np.float32)
    rows = max(1, _PIXELS_PER_STRIP // width)
    for top in range(0, height, rows):
        strip = radiance[top : top + rows]
        decode = _decode_runs if compressed else _decode_uncompressed
        rgbe, offset = decode(file_bytes, offset, len(strip), width)
        # A mantissa byte is in units of 1/256 of 2^(E - 128); E = 0 means black, and 2^-136 is black as well.
        scale = np.ldexp(np.float32(1 / exposure[0]), rgbe[..., 3].astype(np.int32) - 136)
        np.multiply(rgbe[..., :3], scale[..., None], out=strip)
    if (correction != 1.0).any():
        radiance /= correction.astype(np.float32)
    rows_first = radiance if "Y" in header.axes[0] else radiance.swapaxes(0, 1)
    return rows_first[:: -1 if "+Y" in header.axes else 1, :: -1 if "-X" in header.axes else 1]


def radiance_header(file_bytes: bytes) -> PictureHeader:
    """Return the header of a Radiance .hdr file."""
    header = _parse_radiance_header(file_bytes)
    rows_first = "Y" in header.axes[0]
    size = header.lengths[::-1] if rows_first else header.lengths
    primaries = _XYZ_PRIMARIES if header.is_xyz else header.values["PRIMARIES"]
    space = gamma_colour_space("", None, [float(one) for one in primaries]) if np.any(primaries) else SRGB
    notes = [
        f"its {name} of {float(header.values[name][0]):g} is not used"
        for name in _UNUSED_RADIANCE_HEADER_NAMES
        if header.values[name][0] != 1.0
    ]
    colour_note = None if space.is_default else "its colours are converted from its primaries to Rec. 709"
    return PictureHeader(size, space, notes=tuple(notes), colour_note=colour_note)


def _parse_radiance_header(file_bytes: bytes) -> _RadianceHeader:
    found = re.search(
        rb"\n\n([-+][XY]) (\d{1,9}) ([-+][XY]) (\d{1,9})\n", file_bytes[:_MAX_RADIANCE_HEADER_BYTES]
    )
    if not found or found[1][1:] == found[3][1:]:
        raise ValueError("its header has no size of the form -Y height +X width")
    lines = file_bytes[: found.start()].splitlines()
    formats = {line for line in lines if line.startswith(b"FORMAT=")}
    if len(formats) != 1 or not formats <= _RADIANCE_FORMATS:
        raise ValueError("its header does not say FORMAT=32-bit_rle_rgbe or 32-bit_rle_xyze")
    values = {}
    for name, default in _RADIANCE_HEADER_DEFAULTS.items():
        start = f"{name}=".encode()
        rows = [
            [float(one) for one in line[len(start) :].split()] for line in lines if line.startswith(start)
        ]
        values[name] = np.prod([row for row in rows if len(row) == len(default)] or [default], axis=0)
    for name in ("EXPOSURE", "COLORCORR"):
        if not ((values[name] > 1e-30) & (values[name] < 1e30)).all():
            raise ValueError(f"its {name} is {' '.join(f'{one:g}' for one in values[name])}")
    axes, lengths = (found[1].decode(), found[3].decode()), (int(found[2]), int(found[4]))
    check_size(*lengths)
    return _RadianceHeader(axes, lengths, values, _XYZ_FORMAT in formats, found.end())


def _scanline_marker(width: int) -> bytes:
    """Return the four bytes with which a run-length encoded scanline starts."""
    return bytes((2, 2, width >> 8 & 255, width & 255))


def _decode_runs(file_bytes: bytes, byte_offset: int, height: int, width: int) -> tuple[Bytes, int]:
    """Decode run-length encoded scanlines to RGBE pixels (H, W, 4); also return the offset of their end.

    byte_offset : offset of the first scanline in the file [byte]
    height : number of scanlines
    width : number of pixels per scanline
    """
    starts: list[int] = []
    marker, append = _scanline_marker(width), starts.append
    for _ in range(height):
        if file_bytes[byte_offset : byte_offset + 4] != marker:
            raise ValueError("a scanline has an invalid start")
        byte_offset += 4
        for _ in range(4):
            x = 0
            try:
                while x < width:
                    code = file_bytes[byte_offset]
                    append(byte_offset)
                    x += _DECODED_BYTES_BY_RUN_CODE[code]
                    byte_offset += _ENCODED_BYTES_BY_RUN_CODE[code]
            except IndexError:
                raise ValueError("it is truncated") from None
            if x != width:
                raise ValueError("a run is longer than its scanline")
    if byte_offset > len(file_bytes):
        raise ValueError("it is truncated")
    planes = _expand_runs(np.frombuffer(file_bytes, np.uint8), np.array(starts)).reshape(height, 4, width)
    return planes.transpose(0, 2, 1), byte_offset


def _expand_runs(file_bytes: Bytes, code_offsets: Index) -> Bytes:
    """Return the bytes to which run-length codes expand.

    file_bytes : bytes of the file
    code_offsets : (n,) offset of each code in `file_bytes`
    """
    code = file_bytes[code_offsets]
    count = np.array(_DECODED_BYTES_BY_RUN_CODE)[code]
    if not count.all():
        raise ValueError("a run is empty")
    first = np.repeat(code_offsets + 1, count)
    within = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
    return np.asarray(file_bytes[first + within * np.repeat(code <= _MAX_LITERAL_RUN, count)])


def _decode_uncompressed(file_bytes: bytes, byte_offset: int, height: int, width: int) -> tuple[Bytes, int]:
    pixels = np.frombuffer(file_bytes, np.uint8, height * width * 4, byte_offset).reshape(height, width, 4)
    # (1, 1, 1, n) repeats a pixel in the format of before 1991, which current programs do not write.
    if np.any(np.all(pixels[..., :3] == 1, axis=-1)):
        raise ValueError("its pixels use the old run-length encoding")
    return pixels, byte_offset + pixels.size
