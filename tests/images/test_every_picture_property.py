"""Each property of a picture file is treated as its reader declares."""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from icc_profiles import DISPLAY_P3, SRGB_CURVE, encoded, rgb_profile, table_profile, with_png_chunk
from property_rows import Loaded, names_of, row_named, treatment
from test_picture_formats import DEEP_AVIF, tiff

from dermis.base.errors import DermisError
from dermis.environment.panorama import load_panorama
from dermis.formats.maps import load_maps
from dermis.images.hdr import EXR_PROPERTIES, RADIANCE_PROPERTIES
from dermis.images.io import (
    INVALID_PIXEL_PROPERTIES,
    UNSUPPORTED_PICTURE_PROPERTIES,
    EmbeddedPicture,
    read_colours,
    read_image,
)
from dermis.images.opening import PICTURE_PROPERTIES

Reader = Callable[[Any], Any]
LEVELS = np.random.default_rng(5).integers(0, 256, (16, 32, 3)).astype(np.uint8)
GREY = LEVELS[..., 0]
INKS = np.random.default_rng(6).integers(0, 256, (16, 32, 4)).astype(np.uint8)


def linear(path: Any) -> Any:
    pixels, space = read_colours(path)
    return space.to_linear(pixels)


def photograph(path: Any) -> Any:
    return read_colours(path, apply_exif_orientation=True)[0]


def embedded(path: Path) -> Any:
    return linear(EmbeddedPicture("a", path.read_bytes()))


def panorama(path: Path) -> Any:
    return load_panorama(str(path))


def found(read: Reader, path: Path) -> Loaded:
    """Return the pixels of a picture as text, the notes, and the error."""
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        try:
            pixels = np.asarray(read(path))
        except DermisError as error:
            return Loaded("", "", str(error))
    text = f"{pixels.shape} {pixels.tobytes().hex()}"
    return Loaded(text, "\n".join(str(note.message) for note in notes), "")


class Change(NamedTuple):
    """Files before and after a change that exercises the row of which the name begins so."""

    row: str
    after: bytes
    before: bytes
    read: Reader = linear


def png(**options: Any) -> bytes:
    return encoded(LEVELS, "PNG", **options)


def stating(kind: bytes, content: bytes) -> bytes:
    return with_png_chunk(png(), kind, content)


def oriented() -> bytes:
    from PIL import Image

    exif = Image.Exif()
    exif[0x112] = 6
    return png(exif=exif)


def adobe() -> bytes:
    from PIL import Image

    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA001], exif[0x10F] = 2, "Maker"
    return png(exif=exif)


def pages(count: int) -> bytes:
    from PIL import Image

    file, picture = io.BytesIO(), Image.fromarray(LEVELS)
    picture.save(file, "TIFF", save_all=True, append_images=[picture] * (count - 1))
    return file.getvalue()


def lab(rgb: Any) -> Any:
    red, green, blue = rgb.T
    return np.stack(
        [100 * (0.2 * red + 0.7 * green + 0.1 * blue), 60 * (red - green), 60 * (green - blue)], -1
    )


P3 = rgb_profile("P3", DISPLAY_P3, SRGB_CURVE)
ALPHA = np.dstack([LEVELS, GREY])
PICTURES = [
    Change("PNG, JPEG", encoded(LEVELS[::-1], "WEBP", lossless=True), png()),
    Change("8 and 16 bits", encoded(LEVELS[::-1], "PNG"), png()),
    Change("grey, with or", encoded(GREY, "PNG"), png()),
    Change("10 and 12 bits", DEEP_AVIF, png()),
    Change("10 and 12 bits", tiff(5, 257 * INKS.astype(np.uint16)), png()),
    Change("float TIFF", encoded(GREY.astype(np.float32), "TIFF"), encoded(GREY, "PNG")),
    Change("ICC profile of curves", png(icc_profile=P3), png()),
    Change("ICC profile of tables", png(icc_profile=table_profile(b"RGB ", "Scanner", lab)), png()),
    Change(
        "ICC profile that is damaged",
        encoded(LEVELS, "TIFF", icc_profile=b"nonsense"),
        encoded(LEVELS, "TIFF"),
    ),
    Change("CMYK", encoded(INKS, "TIFF", "CMYK"), png()),
    Change("code points (`cICP`", stating(b"cICP", bytes((12, 13, 0, 1))), png()),
    Change("unknown code points", stating(b"cICP", bytes((77, 13, 0, 1))), png()),
    Change("code points of PQ", stating(b"cICP", bytes((9, 16, 0, 1))), png()),
    Change("`gAMA`", stating(b"gAMA", struct.pack(">I", 100000)), png()),
    Change("Adobe RGB", adobe(), png()),
    Change("colour profiles of maps", png(icc_profile=P3), png(), read_image),
    Change("colour profiles of pictures in", png(icc_profile=P3), png(), embedded),
    Change("EXIF orientation of photographs", oriented(), png(), photograph),
    Change("EXIF orientation of maps", oriented(), png()),
    Change("alpha of maps", encoded(ALPHA, "PNG"), png(), read_image),
    Change("several pictures", pages(2), pages(1)),
    Change("raw files", tiff(2, np.zeros((8, 8, 3), np.uint16), b"CR\2\0\0\0\0\0"), png()),
    Change("resolution", png(dpi=(300, 300)), png()),
]
FLOATS = np.random.default_rng(7).uniform(0.1, 1.0, (16, 32, 3)).astype(np.float32)
RGB = dict(zip("RGB", np.moveaxis(FLOATS, 2, 0), strict=True))


def exr(channels: dict[str, Any] | None = None, **header: Any) -> bytes:
    import OpenEXR

    file = io.BytesIO()
    OpenEXR.File(header, {"RGB": FLOATS} if channels is None else channels).write(file)
    return file.getvalue()


def deep() -> bytes:
    import OpenEXR

    samples = np.empty(GREY.shape, object)
    for pixel in np.ndindex(GREY.shape):
        samples[pixel] = np.float32([1.0, 2.0])
    header = {"type": OpenEXR.deepscanline, "compression": OpenEXR.ZIPS_COMPRESSION}
    return exr(dict.fromkeys("RGBA", samples), **header)


def stating_panorama() -> bytes:
    import OpenEXR

    return exr(envmap=OpenEXR.ENVMAP_LATLONG)


def window(x: int, y: int) -> tuple[tuple[int, int], tuple[int, int]]:
    return (0, 0), (x - 1, y - 1)


ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)
LAYERS = {f"{layer}.{name}": values for layer in ("beauty", "diffuse") for name, values in RGB.items()}
ONE_LAYER = {name: values for name, values in LAYERS.items() if name.startswith("beauty")}
EXRS = [
    Change("half, float", exr({"RGB": FLOATS.astype(np.float16)}), exr()),
    Change("deep pixels", deep(), exr()),
    Change("`envmap`", stating_panorama(), exr()),
    Change("layer or part", exr({"red": RGB["R"], "green": RGB["G"], "blue": RGB["R"]}), exr()),
    Change("several layers", exr(LAYERS), exr(ONE_LAYER)),
    Change("a single channel", exr({"height": RGB["R"]}), exr(), read_image),
    Change("luminance with", exr(dict.fromkeys(("Y", "RY", "BY"), RGB["R"])), exr()),
    Change("`dataWindow` inside", exr(dataWindow=window(32, 16), displayWindow=window(40, 20)), exr()),
    Change("`dataWindow` beyond", exr(dataWindow=window(32, 16), displayWindow=window(20, 10)), exr()),
    Change("`chromaticities`", exr(chromaticities=ACES), exr()),
    Change("`chromaticities`", exr(colorInteropID="lin_ap0_scene"), exr()),
    Change("unknown `colorInteropID`", exr(colorInteropID="g22_ap1_scene"), exr()),
    Change("`pixelAspectRatio`", exr(pixelAspectRatio=2.0), exr()),
    Change("`screenWindow...`", exr(whiteLuminance=2.0, comments="a"), exr()),
]
RGBE = np.random.default_rng(8).integers(20, 200, (16, 32, 4)).astype(np.uint8)
RGBE[..., 3] = 128


def hdr(*lines: str, size: str = "-Y 16 +X 32", kind: str = "rgbe", rgbe: Any = RGBE) -> bytes:
    header = ["#?RADIANCE", *lines, f"FORMAT=32-bit_rle_{kind}", "", size, ""]
    return "\n".join(header).encode() + np.ascontiguousarray(rgbe).tobytes()


OLD_RUNS = RGBE.copy()
OLD_RUNS[3, 3] = (1, 1, 1, 9)
RADIANCE = [
    Change("`FORMAT` 32-bit_rle_rgbe", hdr(rgbe=RGBE[::-1]), hdr()),
    Change("`FORMAT` 32-bit_rle_xyze", hdr(kind="xyze"), hdr()),
    Change("other `FORMAT`", hdr(kind="other"), hdr()),
    Change("size", hdr(size="+Y 16 +X 32"), hdr()),
    Change("`EXPOSURE`", hdr("EXPOSURE=2"), hdr()),
    Change("`EXPOSURE`", hdr("COLORCORR=1 2 0.5"), hdr()),
    Change("`PRIMARIES`", hdr(f"PRIMARIES={' '.join(map(str, ACES))}"), hdr()),
    Change("`GAMMA`", hdr("GAMMA=2.2"), hdr()),
    Change("`GAMMA`", hdr("PIXASPECT=0.5"), hdr()),
    Change("run-length", hdr(rgbe=OLD_RUNS), hdr()),
    Change("`VIEW`", hdr("VIEW=-vtv", "SOFTWARE=a", "# a"), hdr()),
]


def odd(value: float, count: int = 1) -> bytes:
    pixels = FLOATS.copy()
    pixels.reshape(-1, 3)[:count] = value
    return exr({"RGB": pixels})


ODD = [
    Change("infinite", odd(np.inf), odd(0.5), panorama),
    *(Change("NaN, negative", odd(value), odd(0.5), panorama) for value in (np.nan, -1.0)),
    Change("more than half", odd(np.nan, 300), odd(0.5), panorama),
    Change("more than half", odd(0.0, 512), odd(0.5), panorama),
    Change("radiance above", odd(1e13), odd(0.5), panorama),
    Change("odd pixels in maps", odd(np.nan), odd(0.5), lambda path: load_maps(colour=path).colour),
]
OTHERS = [
    Change(UNSUPPORTED_PICTURE_PROPERTIES[0].name, start + bytes(64), png())
    for start in (b"GIF89a", b"BM", b"8BPS", b"\xabKTX", b"DDS ", b"\xff\x0a", b"\0\0\0\x0cjP  ")
]
OTHERS.append(Change(UNSUPPORTED_PICTURE_PROPERTIES[0].name, exr(), png(), embedded))
TABLES = {
    "pictures": (PICTURE_PROPERTIES, PICTURES),
    "others": (UNSUPPORTED_PICTURE_PROPERTIES, OTHERS),
    "exr": (EXR_PROPERTIES, EXRS),
    "radiance": (RADIANCE_PROPERTIES, RADIANCE),
    "odd": (INVALID_PIXEL_PROPERTIES, ODD),
}
CASES = [(rows, change) for rows, changes in TABLES.values() for change in changes]
EXERCISED_ELSEWHERE = {"alpha of photographs": "tests/fitting/test_photographs.py, by a fit"}


@pytest.mark.parametrize(("rows", "change"), CASES, ids=[change.row for _, change in CASES])
def test_each_property_is_treated_as_declared(rows: Any, change: Change, tmp_path: Path) -> None:
    path, results = tmp_path / "a.png", []
    for data in (change.before, change.after):
        path.write_bytes(data)
        results.append(found(change.read, path))
    assert treatment(*results) == row_named(rows, change.row).treatment, results[1].notes + results[1].error


def test_all_table_rows_are_exercised() -> None:
    for rows, changes in TABLES.values():
        exercised = {row_named(rows, change.row).name for change in changes}
        assert names_of(rows) - exercised <= EXERCISED_ELSEWHERE.keys()
