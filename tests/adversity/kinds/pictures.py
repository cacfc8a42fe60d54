"""Pictures of all formats, as maps of a head and as panoramas."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from adversity.case import Input, Plan
from adversity.checks import check_finite
from adversity.kind import Kind
from heic_photograph import TURNED_HEIC
from icc_profiles import DISPLAY_P3, SRGB_CURVE, ink_lab, rgb_profile, table_profile, with_png_profile

from dermis.images.codecs import encode_png
from dermis.images.io import write_exr

_P3, _INKS = rgb_profile("P3", DISPLAY_P3, SRGB_CURVE), table_profile(b"CMYK", "Inks", ink_lab)
_TURNED = b"Exif\0\0MM\0*\0\0\0\x08\0\1\x01\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0"
_SIDE = 16
_SKY = 8  # rows


def _levels(kind: type, channels: int) -> Any:
    return np.random.default_rng(channels).integers(0, np.iinfo(kind).max, (_SIDE, _SIDE, channels), kind)


def _with_pillow(pixels: Any, form: str, mode: str | None = None, **how: Any) -> bytes:
    from PIL import Image

    picture = Image.fromarray(pixels)
    file = io.BytesIO()
    (picture.convert(mode) if mode else picture).save(file, form, **how)
    return file.getvalue()


def exr_bytes(channels: int, rows: int = _SIDE, columns: int = _SIDE) -> bytes:
    """Return an EXR picture of constant grey."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "picture.exr"
        write_exr(path, np.full((rows, columns, channels), 0.5, np.float32))
        return path.read_bytes()


def _layered_exr() -> bytes:
    """Return an EXR picture with two layers, other primaries, and a data window inside its display window."""
    import OpenEXR

    names = ("beauty.R", "beauty.G", "beauty.B", "N.X", "N.Y", "N.Z", "diffuse.r", "diffuse.g", "diffuse.b")
    header = {
        "dataWindow": ((2, 3), (_SIDE + 1, _SIDE + 2)),
        "displayWindow": ((0, 0), (_SIDE + 3, _SIDE + 3)),
        "chromaticities": (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767),
    }
    file = io.BytesIO()
    OpenEXR.File(header, {name: np.full((_SIDE, _SIDE), 0.5, np.float32) for name in names}).write(file)
    return file.getvalue()


def hdr_bytes(rows: int, columns: int, *, coded: bool) -> bytes:
    """Return a Radiance picture, with run-length coding if its rows are long enough."""
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nEXPOSURE=1.0\n\n-Y {rows} +X {columns}\n".encode()
    if not coded:
        return head + bytes((90, 80, 70, 128)) * rows * columns
    runs = [min(127, columns - x) for x in range(0, columns, 127)]
    planes = b"".join(bytes((128 + run, value)) for value in (90, 80, 70, 128) for run in runs)
    return head + (bytes((2, 2, columns >> 8, columns & 255)) + planes) * rows


def _normal_map() -> bytes:
    flat = np.full((_SIDE, _SIDE, 3), (128, 128, 255), np.uint8)
    return encode_png(flat)


_MADE: dict[str, Callable[[], bytes]] = {
    "rgb8.png": lambda: encode_png(_levels(np.uint8, 3)),
    "rgb16.png": lambda: encode_png(_levels(np.uint16, 3)),
    "rgba8.png": lambda: encode_png(_levels(np.uint8, 4)),
    "grey8.png": lambda: encode_png(_levels(np.uint8, 1)),
    "grey16.png": lambda: encode_png(_levels(np.uint16, 1)),
    "normal.png": _normal_map,
    "palette.png": lambda: _with_pillow(_levels(np.uint8, 3), "PNG", "P"),
    "la.png": lambda: _with_pillow(_levels(np.uint8, 3), "PNG", "LA"),
    "bits.png": lambda: _with_pillow(_levels(np.uint8, 3), "PNG", "1"),
    "rgb.jpg": lambda: _with_pillow(_levels(np.uint8, 3), "JPEG"),
    "progressive.jpg": lambda: _with_pillow(_levels(np.uint8, 3), "JPEG", progressive=True),
    "rgb8.tif": lambda: _with_pillow(_levels(np.uint8, 3), "TIFF"),
    "lzw.tif": lambda: _with_pillow(_levels(np.uint8, 3), "TIFF", compression="tiff_lzw"),
    "grey16.tif": lambda: _with_pillow(_levels(np.uint16, 1)[..., 0], "TIFF"),
    "float.tif": lambda: _with_pillow(np.full((_SIDE, _SIDE), 0.5, np.float32), "TIFF"),
    "p3.jpg": lambda: _with_pillow(_levels(np.uint8, 3), "JPEG", icc_profile=_P3),
    "deep_p3.png": lambda: with_png_profile(encode_png(_levels(np.uint16, 3)), _P3),
    "cmyk.jpg": lambda: _with_pillow(_levels(np.uint8, 3), "JPEG", "CMYK"),
    "cmyk.tif": lambda: _with_pillow(_levels(np.uint8, 3), "TIFF", "CMYK", icc_profile=_INKS),
    "turned.jpg": lambda: _with_pillow(_levels(np.uint8, 3), "JPEG", exif=_TURNED),
    "rgb.webp": lambda: _with_pillow(_levels(np.uint8, 3), "WEBP"),
    "lossless.webp": lambda: _with_pillow(_levels(np.uint8, 4), "WEBP", lossless=True),
    "rgb.avif": lambda: _with_pillow(_levels(np.uint8, 3), "AVIF"),
    "several.exr": lambda: _layered_exr(),
    "rgb.exr": lambda: exr_bytes(3),
    "rgba.exr": lambda: exr_bytes(4),
    "plain.hdr": lambda: hdr_bytes(_SIDE, _SIDE, coded=False),
    "coded.hdr": lambda: hdr_bytes(_SIDE, 2 * _SIDE, coded=True),
    "labels.png": lambda: encode_png(_levels(np.uint8, 1) % 10),
}
if find_spec("pi_heif"):
    _MADE["turned.heic"] = lambda: TURNED_HEIC
_SKIES: Mapping[str, Callable[[], bytes]] = {
    "sky.hdr": lambda: hdr_bytes(_SKY, 2 * _SKY, coded=True),
    "plain.hdr": lambda: hdr_bytes(_SKY, 2 * _SKY, coded=False),
    "sky.exr": lambda: exr_bytes(3, _SKY, 2 * _SKY),
}


@cache
def picture_bytes(name: str) -> bytes:
    """Return a valid picture file of one of the formats."""
    return (_MADE | _SKIES)[name]()


def _map(rng: Random) -> Input:
    name = rng.choice(tuple(_MADE))
    role = rng.choice(_roles(name))
    option = f"--{role}-map" if role in ("specular", "roughness") else f"--{role}"
    words = ["head.obj", option, name, *["--height-mm", "0.02"] * (role == "height")]
    return Input({name: picture_bytes(name)}, {"file": name, "role": role, "words": words})


def _roles(name: str) -> tuple[str, ...]:
    """Return the maps that a picture can be used for."""
    if name == "normal.png":
        return "colour", "normal"
    grey = name.startswith(("grey", "float", "la", "bits"))
    return ("height", "specular", "roughness") if grey else ("colour",)


def _take_map(plan: Plan) -> None:
    from dermis.formats.maps import load_maps

    how = {"height_mm": 0.02} if plan["role"] == "height" else {}
    check_finite(load_maps(**{plan["role"]: plan["file"]}, **how), "maps")


def _labels(rng: Random) -> Input:
    return Input({"labels.png": picture_bytes("labels.png")}, {"file": "labels.png"})


def _take_labels(plan: Plan) -> None:
    from dermis.formats.maps import load_labels

    load_labels(plan["file"])


def _panorama(rng: Random) -> Input:
    name = rng.choice(tuple(_SKIES))
    return Input({name: picture_bytes(name)}, {"file": name, "words": ["head.obj", "--env", name]})


def _take_panorama(plan: Plan) -> None:
    from dermis.environment.panorama import load_panorama

    check_finite(load_panorama(plan["file"]), "panorama")


def _photograph(rng: Random) -> Input:
    name = rng.choice(tuple(_MADE))
    return Input({name: picture_bytes(name)}, {"file": name})


def _take_photograph(plan: Plan) -> None:
    from dermis.apps.inverse.fitting.inputs import read_photograph

    check_finite(read_photograph(plan["file"]), "photograph")


KINDS = (
    Kind("photograph", _photograph, _take_photograph, share=8),
    Kind("picture", _map, _take_map, share=20),
    Kind("labels", _labels, _take_labels, share=3),
    Kind("panorama", _panorama, _take_panorama, share=8),
)
