"""Reading and writing of picture files: PNG, JPEG, TIFF, WebP, AVIF, HEIC, OpenEXR and Radiance."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from dermis.base import atomic_write
from dermis.base.arrays import Floats, Numbers
from dermis.base.errors import DermisError, error_text, notify, refuse
from dermis.base.file_properties import drawn_property_with_note, refused_property
from dermis.base.reading import read_file
from dermis.images.codecs import Pixels, decode_with_pillow, encode_png
from dermis.images.colour import encode_srgb8
from dermis.images.colour_spaces import SRGB, ColourSpace
from dermis.images.hdr import (
    EXR_SIGNATURE,
    RADIANCE_SIGNATURE,
    decode_exr,
    decode_radiance,
    exr_header,
    radiance_header,
)
from dermis.images.header import PictureHeader, UnsupportedError
from dermis.images.opening import picture_format, pillow_header
from dermis.images.sizes import MAX_FILE_BYTES, TooLargeError

OUTPUT_SUFFIXES = (".png", ".exr")
T = TypeVar("T")
_EXPECTED_PICTURE = "a picture (PNG, JPEG, TIFF, WebP, AVIF, HEIC, EXR or HDR)"


_UNSUPPORTED_FORMATS_BY_SIGNATURE = {
    EXR_SIGNATURE: "OpenEXR inside another file",
    b"GIF8": "GIF",
    b"BM": "BMP",
    b"8BPS": "a Photoshop document",
    b"\xabKTX": "KTX",
    b"DDS ": "DDS",
    b"\xff\x0a": "JPEG XL",
    b"\0\0\0\x0cJXL ": "JPEG XL",
    b"\0\0\0\x0cjP  ": "JPEG 2000",
}
"""Dictionary from the first bytes of a file to the name of its format, for formats that are not read."""
UNSUPPORTED_PICTURE_PROPERTIES = (
    refused_property(", ".join(dict.fromkeys(_UNSUPPORTED_FORMATS_BY_SIGNATURE.values())), "by name"),
)
"""Picture formats that are not read."""
INVALID_PIXEL_PROPERTIES = (
    drawn_property_with_note("infinite", "the largest finite value"),
    drawn_property_with_note("NaN, negative", "0"),
    refused_property("more than half of the pixels not finite, or none above 0"),
    refused_property("radiance above 10¹² in panoramas"),
    refused_property("odd pixels in maps of heads"),
)
"""Invalid pixels of panoramas and linear photographs, and their replacements."""


@dataclass(frozen=True)
class EmbeddedPicture:
    """Picture file that belongs to a glTF file or USD package.

    Colour profiles of the picture are ignored: integer colours are read as sRGB, floats as linear Rec. 709.

    name : name of the picture in error messages
    data : bytes of the picture file, in any format but OpenEXR, or path of a file beside the glTF file
    """

    name: str
    data: bytes | Path = field(repr=False)

    def __str__(self) -> str:
        """Return the name of the picture, which error messages show in place of a path."""
        return self.name


def read_image(path: str | Path | EmbeddedPicture) -> Pixels:
    """Return the stored pixels (H, W, C) of a picture without colour conversion, for data such as heights.

    Row 0 is at the top. C is 1 (grey), 3 (RGB) or 4 (RGBA); grey with alpha becomes RGBA, CMYK becomes RGB.
    Colour profiles and camera orientation are ignored. Notes tell the user which other properties of the file
    are ignored.

    path : PNG, JPEG, TIFF, WebP, AVIF or HEIC, returned as uint8 or uint16 (a float TIFF as float32), or EXR
        or HDR, returned as linear float32; the format is recognised by content, not by suffix

    Raises DermisError when the file is missing, not a picture, truncated, or has unsupported pixels.
    """
    data = read_bytes(path)
    _issue_note(path, _read_header(path, data), read_as_colours=False, apply_exif_orientation=False)
    return _decode_pixels(path, data, convert_lookup_tables=False)


def read_colours(
    path: str | Path | EmbeddedPicture, apply_exif_orientation: bool = False
) -> tuple[Pixels, ColourSpace]:
    """Return the stored pixels (H, W, C) of a colour picture, see `read_image`, and their colour space.

    The colour space is given by the file's profile or primaries; pictures of glTF files are sRGB or linear
    Rec. 709, as glTF requires.

    apply_exif_orientation : whether to rotate the picture by its EXIF orientation, as for photographs

    Raises DermisError as `read_image` does.
    """
    data, embedded = read_bytes(path), isinstance(path, EmbeddedPicture)
    header = _read_header(path, data)
    _issue_note(path, header, read_as_colours=True, apply_exif_orientation=apply_exif_orientation)
    image = _decode_pixels(path, data, convert_lookup_tables=not embedded)
    return _apply_orientation(
        image, header.orientation if apply_exif_orientation else 1
    ), SRGB if embedded else header.colour_space


def note_properties(path: str | Path | EmbeddedPicture, read_as_colours: bool) -> None:
    """Issue the note on a picture's properties, for a caller that has the pixels in a cache.

    The note is the same as when the picture is read from its file.

    read_as_colours : whether to issue the note of `read_colours` instead of that of `read_image`
    """
    _issue_note(path, _read_header(path, read_bytes(path)), read_as_colours, apply_exif_orientation=False)


def _issue_note(
    path: str | Path | EmbeddedPicture,
    header: PictureHeader,
    read_as_colours: bool,
    apply_exif_orientation: bool,
) -> None:
    notes = [*header.notes, *["it is grey, without colours"] * (read_as_colours and header.is_grey)]
    if read_as_colours and header.colour_note:
        embedded = isinstance(path, EmbeddedPicture)
        notes.append("its colour profile is not used, as glTF demands" if embedded else header.colour_note)
    if header.orientation != 1:
        turned = "it is turned upright as its EXIF says"
        notes.append(
            turned if apply_exif_orientation else "it is not turned as its EXIF says, as usual for textures"
        )
    if notes:
        notify(f"{path}: {'; '.join(notes)}")


def repair_radiance(file_name: object, radiance: Floats) -> Floats:
    """Replace infinite, NaN and negative radiance (H, W, C); a note states how many pixels were changed.

    Infinite values become the largest finite value; NaN and negative values become 0.

    file_name : name of the file, for messages

    Raises DermisError if most pixels are not finite, or no value is above 0.
    """
    finite = np.isfinite(radiance)
    if finite.all() and radiance.min() >= 0.0 and radiance.max() > 0.0:
        return radiance
    texels = radiance[..., 0].size
    odd = int((~finite.all(axis=-1)).sum())
    highest = float(radiance.max(where=finite, initial=0.0))
    if 2 * odd > texels or highest <= 0.0:
        actual = f"{odd:,} of its {texels:,} pixels are not finite, and the largest value is {highest:g}"
        refuse(file_name, "a picture of radiance above 0", actual, "Export it again")
    negative = int(((radiance < 0.0) & finite).any(axis=-1).sum())
    faults = {"infinite or NaN": odd, "negative": negative}
    counts = " and ".join(f"{count:,} {kind}" for kind, count in faults.items() if count)
    result = f"infinite values become {highest:g}, the largest finite one, others 0"
    notify(f"{file_name}: {counts} pixels of {texels:,}; {result if odd else 'they become 0'}")
    return np.maximum(np.nan_to_num(radiance, nan=0.0, posinf=highest, neginf=0.0), np.float32(0.0))


def read_size(path: str | Path | EmbeddedPicture) -> tuple[int, int]:
    """Return width and height of a picture from its header, without checking its pixels.

    Raises DermisError when the file is missing, not a picture or too large.
    """
    return _read_header(path, read_bytes(path)).size


def _read_header(path: str | Path | EmbeddedPicture, file_bytes: bytes) -> PictureHeader:
    header: PictureHeader = _apply_format_function(
        path, file_bytes, exr_header, radiance_header, pillow_header
    )
    return header


def _decode_pixels(
    path: str | Path | EmbeddedPicture, file_bytes: bytes, convert_lookup_tables: bool
) -> Pixels:
    pillow = partial(decode_with_pillow, convert_lookup_tables=convert_lookup_tables)
    image: Pixels = _apply_format_function(path, file_bytes, decode_exr, decode_radiance, pillow)
    return image


def _apply_orientation(image: Pixels, orientation: int) -> Pixels:
    """Return a picture (H, W, C) rotated and mirrored according to its EXIF orientation, 1 to 8."""
    upright = image.swapaxes(0, 1) if orientation >= 5 else image
    upright = upright[::-1] if orientation in (3, 4, 7, 8) else upright
    turned: Any = upright[:, ::-1] if orientation in (2, 3, 6, 7) else upright
    pixels: Pixels = np.ascontiguousarray(turned)
    return pixels


def _apply_format_function(
    path: str | Path | EmbeddedPicture,
    file_bytes: bytes,
    exr_function: Callable[[bytes], T],
    radiance_function: Callable[[bytes], T],
    default_function: Callable[[bytes], T],
) -> T:
    """Call the function that handles the format of a picture file; return the result of the function.

    The function gets `file_bytes`. The format is recognised by the first of these bytes.

    file_bytes : bytes of the file
    exr_function : function for OpenEXR files
    radiance_function : function for Radiance .hdr files
    default_function : function for all other formats

    Raises DermisError if the format is unknown, or if the function fails.
    """
    codec = default_function if picture_format(file_bytes) else None
    for start, other in ((EXR_SIGNATURE, exr_function), (RADIANCE_SIGNATURE, radiance_function)):
        codec = other if file_bytes.startswith(start) else codec
    is_inside = isinstance(path, EmbeddedPicture) and isinstance(path.data, bytes)
    if codec is None or (codec is exr_function and is_inside):
        known = next(
            (
                name
                for start, name in _UNSUPPORTED_FORMATS_BY_SIGNATURE.items()
                if file_bytes.startswith(start)
            ),
            None,
        )
        actual = f"it is {known}" if known else "its first bytes match none of these formats"
        refuse(path, _EXPECTED_PICTURE, actual, "Convert it to PNG")
    try:
        return codec(file_bytes)
    except TooLargeError as fault:
        refuse(path, "a picture of at most 8192 x 8192 pixels", str(fault), "Resize it")
    except UnsupportedError as fault:
        refuse(path, _EXPECTED_PICTURE, str(fault), "Convert it to PNG, or to EXR if it is linear")
    except DermisError as fault:  # raised if a package is missing
        raise DermisError(f"{path}: {fault}") from fault
    except Exception as fault:  # decoders raise anything for damaged data
        raise DermisError(
            f"{path}: expected {_EXPECTED_PICTURE}, but it cannot be decoded ({error_text(fault)}). "
            "It is truncated, damaged or of an unsupported kind: download or export it again."
        ) from fault


def check_output(path: str | Path) -> Path:
    """Check before a long computation that a picture can be written to a path, and return the path.

    Raises DermisError for a suffix that is not in `OUTPUT_SUFFIXES`, and when the folder is missing or not
    writable.
    """
    return atomic_write.check_output(path, OUTPUT_SUFFIXES, "Choose .png for viewing, .exr for processing")


def write_image(path: str | Path, linear: NDArray[np.floating]) -> None:
    """Write a linear picture: .png as 8-bit sRGB rounded to nearest, .exr as linear float32.

    Parameters
    ----------
    path : str or Path
        File to write, .png or .exr.
    linear : numpy.ndarray
        (H, W, 3) or (H, W, 4), linear Rec. 709; alpha is not converted to sRGB. Pictures of uint8 are sRGB
        and are written to .png unchanged.

    Raises
    ------
    DermisError
        The suffix or the array is invalid, or the file cannot be written; no partial file is left behind.

    Examples
    --------
    >>> import tempfile
    >>> import numpy as np
    >>> from dermis import write_image
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_image(f"{folder}/grey.png", np.full((2, 3, 3), 0.5))
    """
    if not isinstance(path, str | os.PathLike):
        actual = f"got a {type(path).__name__} first"
        advice = 'Call write_image("face.png", image)'
        refuse("write_image", "the file's name, then the picture", actual, advice)
    linear = np.asarray(linear)
    if linear.ndim not in (2, 3) or linear.dtype.kind not in "fu":
        actual = f"got shape {linear.shape} and type {linear.dtype}"
        refuse(path, "a picture (H, W, 3 or 4) of floats", actual, "Check the array")
    if linear.dtype.kind == "u":
        if linear.dtype != np.uint8 or check_output(path).suffix.lower() == ".exr":
            actual = f"got {linear.dtype}, which is encoded already"
            refuse(path, "linear floats", actual, "Use render_many(..., linear=True), or write a .png file")
        write_png(path, linear)
        return
    if check_output(path).suffix.lower() == ".exr":
        write_exr(path, linear)
        return
    levels = encode_srgb8(linear)
    if linear.shape[-1] == 4:
        levels[..., 3] = np.rint(np.clip(linear[..., 3], 0, 1) * 255)
    write_png(path, levels)


def write_png(path: str | Path, pixel_levels: Numbers, zlib_level: int = 6) -> None:
    """Write integer levels unchanged to a PNG file of 8 bits (uint8) or 16 bits (uint16).

    pixel_levels : (H, W), or (H, W, C) with C of 1, 3 or 4; uint8 or uint16
    zlib_level : compression level of zlib, from 1 (fast) to 9 (small files)
    """
    image = pixel_levels[..., None] if pixel_levels.ndim == 2 else pixel_levels
    if image.ndim != 3 or image.shape[2] not in (1, 3, 4) or image.dtype not in (np.uint8, np.uint16):
        actual = f"they have shape {pixel_levels.shape} and type {pixel_levels.dtype}"
        refuse(path, "pixels (H, W, 1, 3 or 4) of uint8 or uint16", actual, "Convert them first")
    data = encode_png(image, zlib_level)
    with atomic_write.atomic_file(path) as temporary:
        temporary.write_bytes(data)


def write_exr(
    path: str | Path, linear_picture: NDArray[np.floating], use_run_length_encoding: bool = False
) -> None:
    """Write a float32 OpenEXR file with lossless compression.

    linear_picture : (H, W, 3) or (H, W, 4), linear Rec. 709, stored as channels R, G, B (and A)
    use_run_length_encoding : whether to compress by run-length encoding instead of ZIP; for a rendered head,
        run-length encoding is twice as fast, and the files are 4 % larger
    """
    import OpenEXR

    if linear_picture.ndim != 3 or linear_picture.shape[2] not in (3, 4):
        refuse(path, "pixels (H, W, 3 or 4)", f"they have shape {linear_picture.shape}", "Stack them first")
    channels = {
        "RGB" if linear_picture.shape[2] == 3 else "RGBA": np.ascontiguousarray(linear_picture, np.float32)
    }
    with atomic_write.atomic_file(path) as temporary:
        OpenEXR.File(_exr_header(use_run_length_encoding), channels).write(str(temporary))


def encode_exr_parts(
    channels_of_parts: Mapping[str, Mapping[str, Numbers]], use_run_length_encoding: bool = False
) -> bytes:
    """Encode several pictures as the parts of one float32 OpenEXR file with lossless compression.

    channels_of_parts : dictionary from the name of a part to a dictionary from the name of a channel to an
        array (H, W); most programs show only the first part
    use_run_length_encoding : whether to use run-length encoding instead of ZIP, see `write_exr`
    """
    import OpenEXR

    exr_parts = []
    for name, channels in channels_of_parts.items():
        floats = {key: np.ascontiguousarray(values, np.float32) for key, values in channels.items()}
        exr_parts.append(OpenEXR.Part(_exr_header(use_run_length_encoding), floats, name))
    file = io.BytesIO()
    OpenEXR.File(exr_parts).write(file)
    return file.getvalue()


def _exr_header(use_run_length_encoding: bool) -> dict[str, Any]:
    import OpenEXR

    compression = OpenEXR.RLE_COMPRESSION if use_run_length_encoding else OpenEXR.ZIP_COMPRESSION
    return {"compression": compression, "type": OpenEXR.scanlineimage}


def read_bytes(path: str | Path | EmbeddedPicture) -> bytes:
    """Return the bytes of a picture file.

    Raises DermisError when the file cannot be read.
    """
    source = path.data if isinstance(path, EmbeddedPicture) else path
    return source if isinstance(source, bytes) else read_file(source, _EXPECTED_PICTURE, MAX_FILE_BYTES)
