"""Opening of PNG, JPEG, TIFF, WebP, AVIF and HEIC files with Pillow, and parsing of their headers."""

from __future__ import annotations

import io
import struct
import threading
from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from dermis.base.disk import Arrays
from dermis.base.errors import refuse
from dermis.base.extras import import_extra
from dermis.base.file_properties import (
    drawn_property,
    drawn_property_with_note,
    noted_property,
    property_without_effect,
    refused_property,
)
from dermis.base.native_decoding import run_decoder
from dermis.base.reading import MALFORMED_DATA_ERRORS
from dermis.images.colour_spaces import (
    SRGB,
    ColourSpace,
    adobe_rgb,
    coded_colour_space,
    gamma_colour_space,
    profile_colour_space,
    profile_name,
)
from dermis.images.header import PictureHeader, UnsupportedError
from dermis.images.sizes import check_size

if TYPE_CHECKING:
    from PIL.Image import Exif, Image
    from PIL.ImageCms import ImageCmsTransform

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_FORMATS_BY_SIGNATURE = {PNG_SIGNATURE: "PNG", b"\xff\xd8\xff": "JPEG"} | dict.fromkeys(
    (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"), "TIFF"
)
_FORMATS_BY_BRAND = {b"avif": "AVIF", b"avis": "AVIF"} | dict.fromkeys(
    (b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"hevm", b"hevs"), "HEIC"
)
"""Dictionary from the brand in a file to the picture format; AVIF and HEIC share one container format."""
PICTURE_PROPERTIES = (
    drawn_property(
        ", ".join(dict.fromkeys((*_FORMATS_BY_SIGNATURE.values(), "WebP", *_FORMATS_BY_BRAND.values()))),
        "AVIF and WebP need a Pillow that has them, as its wheels do; HEIC needs "
        "the extra `formats`, 16-bit colour the extra `video`",
    ),
    drawn_property("8 and 16 bits, palettes"),
    drawn_property_with_note("grey, with or without alpha", "repeated in all channels of colours"),
    drawn_property_with_note("10 and 12 bits (AVIF, HEIC), CMYK of 16 bits", "reduced to 8"),
    drawn_property("float TIFF", "linear; only grey"),
    drawn_property_with_note(
        "ICC profile of curves: Display P3, Adobe RGB, ProPhoto, linear, grey and others",
        "colours are converted to linear Rec. 709 at full depth; no note for sRGB",
    ),
    drawn_property_with_note(
        "ICC profile of tables, in RGB",
        "colours are converted by LittleCMS at 8 bits, relative to white, with compensation of black",
    ),
    noted_property("ICC profile that is damaged or for other pixels"),
    drawn_property_with_note("CMYK", "converted by its profile likewise, or by subtraction of the inks"),
    drawn_property_with_note("code points (`cICP` of PNG, `nclx` of AVIF and HEIC)", "converted"),
    noted_property("unknown code points"),
    refused_property("code points of PQ and HLG", "levels for HDR displays"),
    drawn_property_with_note("`gAMA`, `cHRM`, `sRGB` of PNG", "converted; no note for sRGB"),
    drawn_property_with_note("Adobe RGB stated in EXIF", "converted"),
    property_without_effect("colour profiles of maps of numbers", "numbers are read as stored"),
    noted_property("colour profiles of pictures in .glb files", "not used, as glTF demands"),
    drawn_property_with_note("EXIF orientation of photographs and of HEIC", "turned upright"),
    noted_property("EXIF orientation of maps"),
    drawn_property_with_note("alpha of photographs", "transparent pixels are not fitted"),
    drawn_property("alpha of maps", "as the material states"),
    noted_property("several pictures in a file: pages, frames, gain maps of phones", "the first is read"),
    refused_property("raw files of cameras, CIELAB, 32-bit integers"),
    property_without_effect("resolution, dates, texts and other metadata"),
)
"""Properties of picture files that Pillow opens."""
_MAX_BRAND_BYTES = 64
_HEIC_FORMAT, _HEIC_DECODER_MODULE = "HEIC", "dermis.images.heic_decoder"
_PILLOW_LOCK = threading.Lock()
_JPEG_SCAN_MARKER = b"\xff\xda"
_MAX_SCANNED_PIXELS = 1 << 30  # total of all scans of a JPEG: sixteen scans of the largest picture
_PILLOW_GREY_MODES = ("1", "L", "LA", "La", "I;16", "I;16B")
_EXIF_ORIENTATION, _EXIF_IFD, _EXIF_COLOUR_SPACE, _INTEROPERABILITY_IFD = 0x112, 0x8769, 0xA001, 0xA005
_EXIF_ADOBE_RGB_COLOUR_SPACE, _EXIF_ADOBE_RGB_INTEROPERABILITY = 2, "R03"
_TIFF_SUBFILE_TYPE, _TIFF_DNG_VERSION, _CANON_RAW_SIGNATURE = 254, 50706, b"CR"
_SRGB_GAMMA, _GAMMA_TOLERANCE = 1 / 2.2, 0.01  # gamma by which PNG files state sRGB


def picture_format(file_bytes: bytes) -> str | None:
    """Return the name of a picture's format, recognised by the first bytes; None if it is not recognised."""
    if file_bytes[:4] == b"RIFF" and file_bytes[8:12] == b"WEBP":
        return "WEBP"
    if file_bytes[4:8] == b"ftyp":
        end = min(int.from_bytes(file_bytes[:4]), _MAX_BRAND_BYTES)
        brands = (file_bytes[start : start + 4] for start in range(8, end, 4))
        return next((_FORMATS_BY_BRAND[brand] for brand in brands if brand in _FORMATS_BY_BRAND), None)
    return next((name for start, name in _FORMATS_BY_SIGNATURE.items() if file_bytes.startswith(start)), None)


def open_picture(file_bytes: bytes) -> Image:
    """Open a picture with Pillow, and check its header and size.

    Pixels are decoded on first use, except those of HEIC, which are decoded at once.

    Raises ValueError, OSError and other errors for a file that is damaged, too large or not supported, and
    DermisError if a package is missing.
    """
    import PIL.Image
    from PIL import features

    name = picture_format(file_bytes) or "PNG"
    if name == _HEIC_FORMAT:
        return _open_heic(file_bytes)
    with _PILLOW_LOCK:  # Pillow's own limit is a global variable and differs
        limit, PIL.Image.MAX_IMAGE_PIXELS = PIL.Image.MAX_IMAGE_PIXELS, None
        try:
            if name in ("WEBP", "AVIF") and not features.check(name.lower()):
                refuse(
                    f"a picture in {name}",
                    "Pillow with this format",
                    "it is built without",
                    "Update it: pip install --upgrade pillow",
                )
            else:
                picture = PIL.Image.open(io.BytesIO(file_bytes), formats=(name,))
        except (PIL.UnidentifiedImageError, SyntaxError) as fault:
            raise ValueError("its header cannot be read, or its kind of pixels is not supported") from fault
        finally:
            PIL.Image.MAX_IMAGE_PIXELS = limit
    check_size(picture.width, picture.height)
    tags = getattr(picture, "tag_v2", {})
    if (
        _TIFF_DNG_VERSION in tags
        or tags.get(_TIFF_SUBFILE_TYPE, 0) & 1
        or file_bytes[8:10] == _CANON_RAW_SIGNATURE
    ):
        raise UnsupportedError("it is a camera's raw file, of which only a preview can be read")
    scanned = file_bytes.count(_JPEG_SCAN_MARKER) * picture.width * picture.height
    if name == "JPEG" and scanned > _MAX_SCANNED_PIXELS:
        raise ValueError("it was stored in too many scans")
    return picture


def _open_heic(file_bytes: bytes) -> Image:
    """Return a HEIC picture, which is decoded in a separate process."""
    import PIL.Image

    import_extra("pi_heif", "a HEIC picture")
    answer = _decode_heic(file_bytes)
    check_size(*answer["size"].tolist())
    bits, turned, several = answer["facts"].tolist()
    picture = PIL.Image.fromarray(answer["pixels"])
    picture.info = {"icc_profile": answer["profile"].tobytes(), "bit_depth": bits, "turned": turned}
    picture.format, picture.is_animated = _HEIC_FORMAT, several  # type: ignore[attr-defined]
    return picture


@lru_cache(maxsize=1)  # cached, as header and pixels of a picture are read one after the other
def _decode_heic(file_bytes: bytes) -> Arrays:
    request = Arrays(data=np.frombuffer(file_bytes, np.uint8))
    return run_decoder(_HEIC_DECODER_MODULE, request, len(file_bytes), "a HEIC picture", "pixels")


def pillow_header(file_bytes: bytes) -> PictureHeader:
    """Return the header of a picture file.

    Raises the same errors as `open_picture`.
    """
    picture = open_picture(file_bytes)
    exif = _read_exif(picture)
    orientation = exif.get(_EXIF_ORIENTATION, 1)
    space, colour_note = _colour_space(file_bytes, picture, exif)
    orientation = orientation if orientation in range(1, 9) else 1
    notes = tuple(_header_notes(file_bytes, picture))
    is_grey = picture.mode in (*_PILLOW_GREY_MODES, "F")
    return PictureHeader((picture.width, picture.height), space, orientation, notes, colour_note, is_grey)


def lookup_table_transform(picture: Image) -> ImageCmsTransform | None:
    """Return the conversion of a picture to 8-bit sRGB if its ICC profile has lookup tables, else None.

    CMYK files and files of some scanners have profiles with lookup tables. The rendering intent is relative
    colorimetric, with black point compensation.
    """
    from PIL import ImageCms

    icc, mode = picture.info.get("icc_profile"), picture.mode
    if not icc or mode not in ("RGB", "RGBA", "CMYK") or _has_curves(icc):
        return None
    try:
        return ImageCms.buildTransform(
            ImageCms.ImageCmsProfile(io.BytesIO(icc)),
            ImageCms.createProfile("sRGB"),
            mode,
            "RGB" if mode == "CMYK" else mode,
            ImageCms.Intent.RELATIVE_COLORIMETRIC,
            ImageCms.Flags.BLACKPOINTCOMPENSATION,
        )
    except (OSError, ImageCms.PyCMSError):  # damaged, or for another kind of pixels
        return None


def _has_curves(icc_profile: bytes) -> bool:
    try:
        return profile_colour_space(icc_profile) is not None
    except (ValueError, *MALFORMED_DATA_ERRORS):
        return False


def _read_exif(picture: Image) -> Exif:
    import PIL.Image

    if picture.format == "PNG" and "exif" not in picture.info:
        return PIL.Image.Exif()  # Pillow would decode all pixels to search for it
    try:
        return picture.getexif()
    except Exception:  # Pillow raises anything for damaged data
        return PIL.Image.Exif()


def _colour_space(file_bytes: bytes, picture: Image, exif: Exif) -> tuple[ColourSpace, str | None]:
    """Return the colour space of the decoded pixels, and a note if this space is not sRGB or is unknown."""
    icc = picture.info.get("icc_profile")
    coded = _colour_code_points(file_bytes, picture)
    if icc and not (coded and picture.format == "PNG"):
        return _colour_space_of_profile(picture, icc)
    if coded:
        space = coded_colour_space(*coded)
        if space is None:
            return SRGB, f"its colour code points {coded} are unknown, and its colours are taken as sRGB"
    elif _is_adobe_rgb(exif):
        space = adobe_rgb()
    else:
        space = _png_colour_space(picture)
    return space, None if space.is_default else _conversion_note(space.name)


def _conversion_note(space_name: str) -> str:
    return f"its colours are converted from {space_name} to sRGB"


def _colour_space_of_profile(picture: Image, icc_profile: bytes) -> tuple[ColourSpace, str | None]:
    """Return the colour space of the decoded pixels of a picture with an ICC profile.

    The second result is a note for the user if colours are converted or the profile is not used, else None.
    """
    name = profile_name(icc_profile) or "a profile without a name"
    is_grey = picture.mode in _PILLOW_GREY_MODES
    try:
        space = profile_colour_space(icc_profile)
    except (ValueError, *MALFORMED_DATA_ERRORS):
        return SRGB, "its colour profile is damaged, and its colours are taken as sRGB"
    if space is None and lookup_table_transform(picture):
        is_cmyk = picture.mode == "CMYK"  # noted at the conversion
        return SRGB, None if is_cmyk else f"{_conversion_note(name)}, at 8 bits a channel"
    if space is None or picture.mode in ("CMYK", "F") or (icc_profile[16:20] == b"GRAY" and not is_grey):
        return SRGB, f"its colour profile, {name}, does not fit its pixels, and is not used"
    return space, None if space.is_default else _conversion_note(name)


def _colour_code_points(file_bytes: bytes, picture: Image) -> tuple[int, int] | None:
    """Return the code points of primaries and transfer function in a PNG, AVIF or HEIC file.

    Returns None for a file without code points.
    """
    if picture.format == "PNG" and (start := file_bytes.find(b"cICP", 0, file_bytes.find(b"IDAT"))) > 0:
        return file_bytes[start + 4], file_bytes[start + 5]
    if picture.format in ("AVIF", _HEIC_FORMAT) and (start := file_bytes.find(b"colrnclx")) > 0:
        primaries, transfer = struct.unpack_from(">HH", file_bytes, start + 8)
        return primaries, transfer
    return None


def _is_adobe_rgb(exif: Exif) -> bool:
    """Return whether EXIF declares Adobe RGB; most cameras declare it only there, without an ICC profile."""
    try:
        file_kind = str(exif.get_ifd(_INTEROPERABILITY_IFD).get(1, "")).strip("\0 ")
        return (
            file_kind == _EXIF_ADOBE_RGB_INTEROPERABILITY
            or exif.get_ifd(_EXIF_IFD).get(_EXIF_COLOUR_SPACE) == _EXIF_ADOBE_RGB_COLOUR_SPACE
        )
    except Exception:  # Pillow raises anything for damaged data
        return False


def _png_colour_space(picture: Image) -> ColourSpace:
    """Return the colour space that a PNG file declares by its gamma and chromaticities.

    Returns sRGB for PNG files without gamma, and for other formats.
    """
    gamma, corners = picture.info.get("gamma"), picture.info.get("chromaticity")
    if picture.format != "PNG" or "srgb" in picture.info or not gamma:
        return SRGB
    is_srgb = abs(gamma - _SRGB_GAMMA) < _GAMMA_TOLERANCE
    primaries = (*corners[2:], *corners[:2]) if corners else None
    return gamma_colour_space(f"gamma {gamma:.3g}", None if is_srgb else 1.0 / gamma, primaries)


def _header_notes(file_bytes: bytes, picture: Image) -> Iterator[str]:
    """Yield notes for the user about properties of a picture that are converted or not used."""
    if picture.mode == "CMYK":
        profile = (
            profile_name(picture.info.get("icc_profile", b"")) if lookup_table_transform(picture) else ""
        )
        how = f"by its profile, {profile}" if profile else "without a profile, so that its colours are rough"
        yield f"its CMYK is converted to sRGB {how}"
    if (bits := _stored_bits_per_channel(file_bytes, picture)) > 8:
        yield f"its {bits} bits a channel are reduced to 8"
    if picture.info.get("turned"):
        yield "it is turned upright as its EXIF says"
    if _has_more_pictures(picture):
        yield "it has several pictures, and only the first is read"


def _stored_bits_per_channel(file_bytes: bytes, picture: Image) -> int:
    """Return the stored bits per channel of AVIF and HEIC, and of TIFF in CMYK; 8 for other files."""
    if picture.format == "AVIF" and (start := file_bytes.find(b"av1C")) > 0 and file_bytes[start + 6] & 0x40:
        return 12 if file_bytes[start + 6] & 0x20 else 10
    if picture.mode == "CMYK":
        return int(max(getattr(picture, "tag_v2", {}).get(258, (8,))))
    return int(picture.info.get("bit_depth", 8))


def _has_more_pictures(picture: Image) -> bool:
    """Return whether a file has further pictures: frames, pages, or the gain map of a phone's photograph."""
    if picture.format != "TIFF":
        return bool(getattr(picture, "is_animated", False))
    try:
        picture.seek(1)
    except (EOFError, OSError, ValueError, SyntaxError, *MALFORMED_DATA_ERRORS):
        return False
    return True
