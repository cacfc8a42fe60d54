"""What is known of an image, from the bytes of its files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.encodings import decode_output, decode_png
from dermis.apps.batch.entries import PICTURE, RECORD
from dermis.base.atomic_write import reason
from dermis.base.errors import DermisError, refuse
from dermis.base.reading import MOST_TEXT, parse_json, understood
from dermis.scene.opencv import OpenCvCamera

_OUTPUT_NAME = re.compile(r"([a-z0-9_]+)\.(png|exr|npy)")
_KNOWN = frozenset(("number", "picture", "parameters", "camera", "head_pose", "gaze", "landmarks"))
_PLAIN = int | float | str | bool | None


class Points(NamedTuple):
    """Landmarks of an image; NaN where one has no place.

    pixels : (n, 2), x to the right and y down, from the middle of the first pixel
    positions_mm : (n, 3), from the head's centre
    visible : (n,) whether nothing lies before it
    """

    pixels: NDArray[np.float64]
    positions_mm: NDArray[np.float64]
    visible: NDArray[np.bool_]


def decoded(files: Mapping[str, Any], culprit: object = "") -> dict[str, Any]:
    """An image of its files, which are bytes by suffix, as the library webdataset gives them.

    culprit : named in messages; the image's key where empty

    number, parameters : which image of the data set it is, and all that was drawn for it, by name
    picture : (h, w, 3 or 4) sRGB bytes
    camera : K, R and t as OpenCV has them
    head_pose, gaze : (3, 4) and (2, 3), as of `Observation`; gaze may be None
    landmarks : `Points` by the name of their set
    depth, normal, ... : the outputs of the data set, float32 or integers

    Raises DermisError where they are damaged.
    """
    named = culprit or files.get("__key__", "an image")
    data = {suffix: one for suffix, one in files.items() if not suffix.startswith("__")}
    for needed in (PICTURE, RECORD):
        if not isinstance(data.get(needed), bytes):
            refuse(named, "an image of a data set", f"its .{needed} is missing", "Fetch it again")
    found = _record(data.pop(RECORD), f"{named}.{RECORD}")
    found["picture"] = _picture(f"{named}.{PICTURE}", "", PICTURE, data.pop(PICTURE))
    if found["picture"].dtype != np.uint8:
        refuse(named, "a picture of 8 bits", f"it has {found['picture'].dtype}", "Fetch it again")
    for suffix, content in sorted(data.items()):
        match = _OUTPUT_NAME.fullmatch(suffix)
        if match is None or match[1] in _KNOWN:
            refuse(named, "files of outputs", f".{suffix} is none", "Take it out")
        values = _picture(f"{named}.{suffix}", match[1], match[2], content)
        if values.shape[:2] != found["picture"].shape[:2]:
            came = f".{suffix} has {values.shape[1]} x {values.shape[0]} pixels"
            refuse(named, "outputs of the picture's size", came, "Fetch it again")
        found[match[1]] = values
    return found


def record_of(data: bytes, culprit: object) -> dict[str, Any]:
    """What an image's record says, with lists in place of arrays.

    Raises DermisError where it is damaged.
    """
    if len(data) > MOST_TEXT:
        refuse(culprit, "a record of an image", f"it has {len(data):,} bytes", "Fetch it again")
    told = parse_json(data, culprit, "a record of an image")
    with understood(culprit, "a record of an image", KeyError, TypeError, AttributeError):
        if type(told["number"]) is not int:
            raise ValueError("its number is none")
        for name, value in told["parameters"].items():
            parts = value if isinstance(value, list) else [value]
            if not all(isinstance(one, _PLAIN) for one in parts):
                raise ValueError(f"{name[:60]!r} is neither a number nor a text")
        _camera(told["camera"])
        _array(told["head_pose"], (3, 4))
        _gaze(told["gaze"])
        return dict(told)


def _record(data: bytes, culprit: object) -> dict[str, Any]:
    told = record_of(data, culprit)
    with understood(culprit, "a record of an image", KeyError, TypeError, AttributeError):
        return {
            "number": told["number"],
            "parameters": told["parameters"],
            "camera": _camera(told["camera"]),
            "head_pose": _array(told["head_pose"], (3, 4)),
            "gaze": _gaze(told["gaze"]),
            "landmarks": {name: _points(one) for name, one in told["landmarks"].items()},
        }


def _camera(told: Mapping[str, Any]) -> OpenCvCamera:
    return OpenCvCamera(_array(told["K"], (3, 3)), _array(told["R"], (3, 3)), _array(told["t"], (3,)))


def _gaze(told: Any) -> NDArray[np.float64] | None:
    return None if told is None else _array(told, (2, 3))


def _points(told: Mapping[str, Any]) -> Points:
    if not all(isinstance(one, bool) for one in told["visible"]):
        raise ValueError("whether landmarks are visible is told otherwise than by true and false")
    visible = np.array(told["visible"], bool)
    count = len(visible)
    return Points(_array(told["pixels"], (count, 2)), _array(told["positions_mm"], (count, 3)), visible)


def _array(told: Any, shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Numbers, NaN where there is null."""
    flat = told if isinstance(told, list) else [told]
    while flat and isinstance(flat[0], list):
        flat = [one for row in flat for one in row]
    if any(isinstance(one, str | bool) for one in flat):
        raise ValueError("it has texts for numbers")
    found = np.array(told, np.float64)
    if found.shape != shape and (found.size or 0 not in shape):
        raise ValueError(f"an array has shape {found.shape}, not {shape}")
    return found.reshape(shape)


def _picture(culprit: object, name: str, kind: str, data: Any) -> NDArray[Any]:
    try:
        return decode_output(name, kind, data) if name else decode_png(data)
    except DermisError as fault:  # a package is missing
        raise DermisError(f"{culprit}: {fault}") from fault
    except Exception as fault:  # decoders raise anything for damaged data
        came = f"it cannot be decoded ({reason(fault)})"
        refuse(culprit, f"a picture as {kind}", came, "Fetch it again, or have it drawn again")
