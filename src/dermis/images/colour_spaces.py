"""Colour spaces declared in picture files, and conversion of their pixels to linear Rec. 709."""

from __future__ import annotations

import io
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from dermis.base.arrays import Bytes, Doubles, Floats, Numbers
from dermis.base.errors import shorten
from dermis.images.colour import decode_srgb, decode_srgb_levels

_D65_CHROMATICITY = (0.3127, 0.329)
_PRIMARIES: dict[str, tuple[float, ...]] = {
    "Rec. 709": (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, *_D65_CHROMATICITY),
    "Rec. 601": (0.63, 0.34, 0.31, 0.595, 0.155, 0.07, *_D65_CHROMATICITY),
    "PAL": (0.64, 0.33, 0.29, 0.6, 0.15, 0.06, *_D65_CHROMATICITY),
    "Rec. 2020": (0.708, 0.292, 0.17, 0.797, 0.131, 0.046, *_D65_CHROMATICITY),
    "Display P3": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, *_D65_CHROMATICITY),
    "Adobe RGB": (0.64, 0.33, 0.21, 0.71, 0.15, 0.06, *_D65_CHROMATICITY),
}
"""Chromaticities x, y of red, green, blue and white."""
_ADOBE_GAMMA = 563 / 256
_CODED_PRIMARIES = {1: "Rec. 709", 2: "Rec. 709", 5: "PAL", 6: "Rec. 601", 9: "Rec. 2020", 12: "Display P3"}
"""Dictionary from code points of primaries in ITU-T H.273 to names in `_PRIMARIES`."""
_CODED_GAMMAS = {1: None, 2: None, 4: 2.2, 5: 2.8, 6: None, 8: 1.0, 13: None, 14: None, 15: None}
"""Dictionary from code points of transfer functions in ITU-T H.273 to gammas; None for sRGB and for the
curves of video, which programs display as sRGB."""
_HDR_CURVES = {16: "PQ", 18: "HLG"}
_CURVE_LEVEL_COUNT, _MAX_CURVE_LEVEL = 65536, 65535
_CURVE_SAMPLE_LEVELS = np.linspace(0.0, 1.0, _CURVE_LEVEL_COUNT)
_SRGB_CURVE_TOLERANCE = 5e-3  # a matrix or curve that differs less from that of sRGB is replaced by it
_D50_XYZ = np.array([0.9642, 1.0, 0.8249])
BRADFORD_MATRIX = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
_ICC_HEADER_BYTES, _MAX_ICC_TAGS = 128, 200
_MAX_PROFILE_NAME_LENGTH = 60  # characters


@dataclass(frozen=True, eq=False)
class ColourSpace:
    """Colour space of a picture's pixels; by default, integers are sRGB and floats are linear Rec. 709.

    name : name of the colour space, for notes to the user
    to_rec709 : (3, 3) matrix from linear colours to linear Rec. 709; None for the primaries of Rec. 709
    curves : (3, 65536) linear values of each channel at evenly spaced levels; None for sRGB's curve
    """

    name: str = "sRGB"
    to_rec709: Doubles | None = None
    curves: Floats | None = None

    @property
    def is_default(self) -> bool:
        """Return whether integer pixels are sRGB, and float pixels are linear Rec. 709."""
        return self.to_rec709 is None and self.curves is None

    def to_linear(self, pixels: Numbers) -> Floats:
        """Convert pixels (..., C) with 1, 3 or 4 channels to linear Rec. 709 (..., 3).

        Grey is repeated in all channels; alpha is dropped.

        If the primaries are converted, results below 0 are clipped; for integer pixels, results above 1 are
        clipped too.
        """
        rgb = pixels[..., :3] if pixels.shape[-1] >= 3 else np.repeat(pixels, 3, axis=-1)
        if rgb.dtype.kind == "f":
            linear = np.ascontiguousarray(rgb, np.float32)
        elif self.curves is None:
            linear = decode_srgb_levels(cast(Bytes, rgb))
        else:
            index = rgb.astype(np.uint16) * np.uint16(_MAX_CURVE_LEVEL // np.iinfo(rgb.dtype.str).max)
            linear = np.stack([self.curves[c][index[..., c]] for c in range(3)], axis=-1)
        if self.to_rec709 is None:
            return linear
        converted = linear @ self.to_rec709.T.astype(np.float32)
        return np.clip(converted, 0.0, None if rgb.dtype.kind == "f" else 1.0, out=converted)


SRGB = ColourSpace()


def adobe_rgb() -> ColourSpace:
    """Return Adobe RGB (1998), which cameras may declare in EXIF without embedding an ICC profile."""
    return _simplified_colour_space(
        "Adobe RGB", _matrix_to_rec709(_PRIMARIES["Adobe RGB"]), _CURVE_SAMPLE_LEVELS**_ADOBE_GAMMA
    )


def coded_colour_space(primaries_code: int, transfer_code: int) -> ColourSpace | None:
    """Return the colour space for ITU-T H.273 code points, as in AVIF, HEIC and PNG; None for unknown codes.

    primaries_code, transfer_code : code points of the primaries and of the transfer function

    Raises ValueError for the transfer functions of HDR displays.
    """
    if transfer_code in _HDR_CURVES:
        raise ValueError(f"its levels are coded for HDR displays ({_HDR_CURVES[transfer_code]})")
    if primaries_code not in _CODED_PRIMARIES or transfer_code not in _CODED_GAMMAS:
        return None
    name, gamma = _CODED_PRIMARIES[primaries_code], _CODED_GAMMAS[transfer_code]
    return gamma_colour_space(name, gamma, _PRIMARIES[name])


def gamma_colour_space(
    space_name: str, gamma: float | None, primaries: Sequence[float] | None
) -> ColourSpace:
    """Return the colour space with the given gamma and primaries.

    gamma : exponent that converts levels to linear values; None for the curve of sRGB
    primaries : chromaticities x, y of red, green, blue and white; None for Rec. 709

    Raises ValueError for primaries that are invalid or lie on one line.
    """
    matrix = np.eye(3) if primaries is None else _matrix_to_rec709(primaries)
    return _simplified_colour_space(
        space_name, matrix, None if gamma is None else _CURVE_SAMPLE_LEVELS**gamma
    )


def profile_name(icc_profile: bytes) -> str:
    """Return the printable name of an ICC profile; empty if the name cannot be read."""
    from PIL import ImageCms

    try:
        name = ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(io.BytesIO(icc_profile)))
    except (OSError, ImageCms.PyCMSError):
        return ""
    return shorten("".join(one for one in name.strip() if one.isprintable()), _MAX_PROFILE_NAME_LENGTH)


def profile_colour_space(icc_profile: bytes) -> ColourSpace | None:
    """Return the colour space of an ICC profile; None if the profile has lookup tables or no curves.

    LittleCMS is not used, because its interface in Pillow supports only 8 bits per channel.

    Raises ValueError, ArithmeticError and struct.error for a damaged profile.
    """
    (count,) = struct.unpack_from(">I", icc_profile, _ICC_HEADER_BYTES)
    rows = struct.iter_unpack(">4sII", icc_profile[_ICC_HEADER_BYTES + 4 :][: 12 * min(count, _MAX_ICC_TAGS)])
    tags = {name: icc_profile[offset : offset + size] for name, offset, size in rows}
    kind, channels = icc_profile[16:20], b"rgb"
    if b"A2B0" in tags or {b"RGB ": b"rTRC", b"GRAY": b"kTRC"}.get(kind, b"") not in tags:
        return None
    if kind == b"GRAY":
        return _simplified_colour_space(profile_name(icc_profile), np.eye(3), _profile_curve(tags[b"kTRC"]))
    columns = [_fixed_point_numbers(tags[b"%cXYZ" % one], 3) for one in channels]
    curves = [_profile_curve(tags[b"%cTRC" % one]) for one in channels]
    to_rec709 = np.linalg.inv(_matrix_to_xyz(_PRIMARIES["Rec. 709"])) @ np.array(columns).T
    return _simplified_colour_space(profile_name(icc_profile), to_rec709, np.array(curves))


def _simplified_colour_space(space_name: str, to_rec709: Doubles, curves: Doubles | None) -> ColourSpace:
    """Return a colour space, with None in place of a matrix or curves that are equal to those of sRGB.

    to_rec709 : see `ColourSpace`
    curves : see `ColourSpace`; a single curve (65536,) is used for all channels
    """
    if curves is not None:
        same = np.allclose(curves, decode_srgb(_CURVE_SAMPLE_LEVELS), rtol=0.0, atol=_SRGB_CURVE_TOLERANCE)
        curves = None if same else np.broadcast_to(curves, (3, _CURVE_LEVEL_COUNT))
    same = np.allclose(to_rec709, np.eye(3), rtol=0.0, atol=_SRGB_CURVE_TOLERANCE)
    return ColourSpace(
        space_name, None if same else to_rec709, None if curves is None else np.asarray(curves, np.float32)
    )


def _matrix_to_rec709(primaries: Sequence[float]) -> Doubles:
    """Return the matrix (3, 3) from linear RGB with the given primaries to linear Rec. 709.

    The white of the primaries becomes the white of Rec. 709.

    primaries : chromaticities x, y of red, green, blue and white
    """
    return np.asarray(np.linalg.inv(_matrix_to_xyz(_PRIMARIES["Rec. 709"])) @ _matrix_to_xyz(primaries))


def _matrix_to_xyz(primaries: Sequence[float]) -> Doubles:
    """Return the matrix (3, 3) from linear RGB to CIE XYZ, adapted to D50, the white point of ICC profiles.

    primaries : chromaticities x, y of red, green, blue and white
    """
    x, y = np.asarray(primaries, np.float64).reshape(4, 2).T
    xyz = np.stack([x, y, 1.0 - x - y])
    if not (np.isfinite(xyz).all() and y[3] > 0.0 and abs(np.linalg.det(xyz[:, :3])) > 1e-6):
        raise ValueError("its primaries span no colours")
    white = xyz[:, 3] / y[3]
    adapted = BRADFORD_MATRIX @ _D50_XYZ / (BRADFORD_MATRIX @ white)
    adaptation = np.linalg.inv(BRADFORD_MATRIX) @ (adapted[:, None] * BRADFORD_MATRIX)
    return np.asarray(adaptation @ (xyz[:, :3] * np.linalg.solve(xyz[:, :3], white)))


def _profile_curve(curve_tag: bytes) -> Doubles:
    """Return the linear values (65536,) of evenly spaced levels, from a curve tag of an ICC profile."""
    kind, (count,) = curve_tag[:4], struct.unpack_from(">I", curve_tag, 8)
    if kind == b"curv" and count < 2:
        gamma = struct.unpack_from(">H", curve_tag, 12)[0] / 256.0 if count else 1.0
        return np.asarray(_CURVE_SAMPLE_LEVELS**gamma)
    if kind == b"curv":
        values = np.frombuffer(curve_tag, ">u2", count, 12) / _MAX_CURVE_LEVEL
        return np.asarray(np.interp(_CURVE_SAMPLE_LEVELS, np.linspace(0.0, 1.0, count), values))
    if kind != b"para" or count >> 16 > 4:
        raise ValueError("a curve is of an unknown kind")
    function = count >> 16
    numbers = _fixed_point_numbers(curve_tag, (1, 3, 4, 5, 7)[function], 12) + [1.0, 0.0] * (function == 0)
    if function <= 2:  # constant up to -b / a
        (g, a, b), offset = numbers[:3], sum(numbers[3:])
        c, d, e, f = 0.0, -b / a, offset, offset
    else:
        g, a, b, c, d, e, f = (*numbers, 0.0, 0.0)[:7]
    with np.errstate(all="ignore"):
        power = np.maximum(a * _CURVE_SAMPLE_LEVELS + b, 0.0) ** g + e
    curve = np.where(d <= _CURVE_SAMPLE_LEVELS, power, c * _CURVE_SAMPLE_LEVELS + f)
    return np.asarray(np.clip(np.nan_to_num(curve), 0.0, 1.0))


def _fixed_point_numbers(tag_bytes: bytes, number_count: int, byte_offset: int = 8) -> list[float]:
    """Read numbers in signed fixed point with 16 fractional bits from a tag of an ICC profile.

    byte_offset : offset of the first number in the tag [byte]
    """
    return [value / 65536.0 for value in struct.unpack_from(f">{number_count}i", tag_bytes, byte_offset)]
