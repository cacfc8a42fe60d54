"""Reader of camera calibrations in OpenCV's conventions: JSON, and YAML as OpenCV and ROS write it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dermis.apps.batch.sensor.lens import Lens
from dermis.base.arrays import Doubles
from dermis.base.errors import error_context, format_value, refuse, shorten
from dermis.base.quantities import checked_array
from dermis.base.reading import parse_json, read_text
from dermis.scene.camera import Camera

MAX_CAMERAS = 256
_BOUNDS = -1e9, 1e9
_FORMS = 'a list "cameras" with K, R, t and size, or the K1, D1, K2, D2, R, T of a stereo calibration'
_KEYS: Mapping[str, tuple[str, ...]] = {
    "K": ("K", "camera_matrix", "cameraMatrix", "intrinsic_matrix"),
    "dist": ("dist", "D", "distortion_coefficients", "distCoeffs", "dist_coeffs", "distortion"),
    "R": ("R", "rotation", "rotation_matrix"),
    "t": ("t", "T", "tvec", "translation"),
    "size": ("size", "image_size", "imageSize", "resolution"),
    "name": ("name", "camera_name"),
}
_LENS_FIELDS = tuple(Lens.model_fields)  # k1, k2, p1, p2, k3: the order of OpenCV
_MODEL, _LENS_MODELS = "distortion_model", ("plumb_bob", "rational_polynomial", "radtan")
_ITEMS, _ITEM_INDENT = "", 0.5  # key of the items of a list; indent of an item after its dash
_LINE = re.compile(
    r'^(?P<indent> *)(?P<dash>-(?: +|$))?(?:(?P<key>[\w.-]+|"[^"]*") *:(?: +(?P<value>.*))?)?$'
)
_TAG = re.compile(r"^!!?[\w-]+ *")


class Calibration(NamedTuple):
    """Calibrated camera.

    name : name of the camera
    K : (3, 3) intrinsic matrix [pixel]
    lens : distortion
    R : (3, 3) rotation from the world of the calibration to the camera
    t : (3,) translation [unit of the file]
    size : width and height of the pictures [pixel]
    """

    name: str
    K: Doubles
    lens: Lens
    R: Doubles
    t: Doubles
    size: tuple[int, int]


def load_calibrations(path: Path) -> tuple[Calibration, ...]:
    """Return the cameras in a file of calibrations, .json, .yaml or .yml.

    Raises DermisError for files of another form, and for matrices that do not describe cameras.
    """
    text = read_text(path, "calibrations of cameras")
    with error_context(path):
        data = (
            parse_json(text, path, "calibrations in JSON")
            if path.suffix.lower() == ".json"
            else parse_opencv_yaml(text)
        )
        cameras = tuple(_calibration(name, one) for name, one in _camera_tables(data))
        if not 2 <= len(cameras) <= MAX_CAMERAS:
            refuse("cameras", f"2 to {MAX_CAMERAS} cameras", f"got {len(cameras)}", "Correct it")
        if len({one.name for one in cameras}) < len(cameras):
            actual = f"got {shorten(', '.join(one.name for one in cameras), 80)}"
            refuse("cameras", "a different name for each camera", actual, "Rename cameras")
        return cameras


def scaled_intrinsics(calibration: Calibration, picture_size: tuple[int, int]) -> Doubles:
    """Return the intrinsic matrix (3, 3) for pictures of another size with the same view [pixel].

    Raises DermisError for a size with another ratio of width to height.
    """
    (width, height), (own_width, own_height) = picture_size, calibration.size
    if abs(height - width * own_height / own_width) > 1.0:  # pixels
        expected = (
            f"pictures in the ratio of {own_width} x {own_height}, the size of camera {calibration.name}"
        )
        refuse("size", expected, f"got {width} x {height}", "Change size, above all tables")
    x, y = width / own_width, height / own_height
    K = calibration.K.copy()
    K[0], K[1] = K[0] * x, K[1] * y
    K[:2, 2] = (calibration.K[:2, 2] + 0.5) * [x, y] - 0.5  # pixel centres are integers
    return K


def parse_opencv_yaml(text: str) -> dict[str, Any]:
    """Return the mappings, scalars and lists of numbers in the subset of YAML that OpenCV writes.

    Raises DermisError for other YAML.
    """
    root: dict[str, Any] = {}
    parents: list[tuple[float, dict[str, Any]]] = [(-1.0, root)]  # indents of the lines that open mappings
    for number, line in _logical_lines(text):
        match = _LINE.match(line)
        if match is None:
            refuse(f"line {number}", "key: value", f"got {shorten(line.strip(), 60)!r}", "Convert it to JSON")
        indent, dash = len(match["indent"]), match["dash"]
        while parents[-1][0] >= indent + (_ITEM_INDENT if dash else 0.0):
            parents.pop()
        if dash:
            item: dict[str, Any] = {}
            parents[-1][1].setdefault(_ITEMS, []).append(item)
            parents.append((indent + _ITEM_INDENT, item))
        if match["key"] is None:
            continue
        value = _TAG.sub("", (match["value"] or "").strip())
        child: dict[str, Any] = {}
        parents[-1][1][match["key"].strip('"')] = _scalar(value) if value else child
        if not value:
            parents.append((indent + len(dash or ""), child))
    return root


def _logical_lines(text: str) -> Iterator[tuple[int, str]]:
    """Yield number and text of each line without comments, with lists in brackets joined to one line."""
    joined, start = "", 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.split(" #")[0].rstrip()
        if not joined and (not line.strip() or line.lstrip()[0] in "#%" or line in ("---", "...")):
            continue
        joined, start = (f"{joined} {line.strip()}", start) if joined else (line, number)
        if joined.count("[") == joined.count("]"):
            yield start, joined
            joined = ""
    if joined:
        refuse(f"line {start}", "a list that ends with ]", "it does not end", "Correct it")


def _scalar(text: str) -> float | str | list[Any]:
    if text.startswith("["):
        nested = parse_json(re.sub(r"(?<=\d)\.(?=\D)", ".0", text), "list", "numbers in [ ]")
        return list(nested) if isinstance(nested, list) else []
    try:
        return float(text)
    except ValueError:
        return text.strip("\"'")


def _camera_tables(data: object) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the name and the table of each camera in a parsed file."""
    if not isinstance(data, Mapping):
        refuse("file", _FORMS, f"got {type(data).__name__}", "Correct it")
    if {"R", "T"} <= data.keys() and any(f"{name}1" in data for name in ("K", "M", *_KEYS["K"])):
        return _stereo_tables(data)
    cameras = data.get("cameras", data)
    cameras = cameras.get(_ITEMS, cameras) if isinstance(cameras, Mapping) else cameras
    named = (
        cameras.items()
        if isinstance(cameras, Mapping)
        else enumerate(cameras if isinstance(cameras, list) else ())
    )
    is_list = isinstance(cameras, list)
    tables = [(str(name), one) for name, one in named if is_list or _is_camera(one)]
    if not tables:
        refuse("file", _FORMS, f"it has {shorten(', '.join(map(str, data)), 80)}", "Correct it")
    return tables


def _is_camera(value: object) -> bool:
    """Return whether a value in a file describes a camera, rather than something else."""
    return isinstance(value, Mapping) and any(_value(value, name) is not None for name in ("K", "R", "t"))


def _stereo_tables(data: Mapping[str, Any]) -> list[tuple[str, Mapping[str, Any]]]:
    """Return the tables of the two cameras of cv2.stereoCalibrate, in the coordinates of the first one."""
    tables: list[tuple[str, Mapping[str, Any]]] = []
    for k, (R, t) in enumerate([(np.eye(3).tolist(), [0.0, 0.0, 0.0]), (data["R"], data["T"])], 1):
        own = {
            name: next((data[f"{key}{k}"] for key in keys if f"{key}{k}" in data), None)
            for name, keys in _KEYS.items()
        }
        own["K"] = own["K"] if own["K"] is not None else data.get(f"M{k}")
        size = own["size"] if own["size"] is not None else _value(data, "size")
        tables.append((("left", "right")[k - 1], {**own, "R": R, "t": t, "size": size}))
    return tables


def _value(table: Mapping[str, Any], name: str) -> Any:
    found = next((table[key] for key in _KEYS[name] if table.get(key) is not None), None)
    if found is None and name == "size" and {"image_width", "image_height"} <= table.keys():
        return [table["image_width"], table["image_height"]]
    if isinstance(found, Mapping) and {"rows", "cols", "data"} <= found.keys():
        matrix = _numbers(name, found["data"])
        rows, cols = _numbers(name, [found["rows"], found["cols"]])
        shape = int(rows), int(cols)
        if matrix.size != shape[0] * shape[1]:
            refuse(name, f"{shape[0]} x {shape[1]} numbers", f"got {matrix.size}", "Correct it")
        return matrix.reshape(shape).tolist()
    return found


def _calibration(name: str, table: Mapping[str, Any]) -> Calibration:
    """Return a camera of a file; R, t and the distortion may be missing."""
    stated = table.get("name") or table.get("camera_name") if isinstance(table, Mapping) else None
    name = str(stated) if isinstance(stated, str | int | float) else name
    with error_context(f"camera {name}"):
        if not isinstance(table, Mapping):
            refuse("camera", "a table with K, R, t and size", f"got {format_value(table)}", "Correct it")
        if _value(table, "size") is None:
            refuse("size", "width and height of the pictures", "there are none", "Add size = [width, height]")
        width, height = checked_array("size", _numbers("size", _value(table, "size")), (2,), 1, 1e6).astype(
            int
        )
        K, R = (_matrix(table, part) for part in ("K", "R"))
        stated_t = _value(table, "t")
        t = checked_array("t", _numbers("t", [0.0] * 3 if stated_t is None else stated_t), (3,), *_BOUNDS)
        size = int(width), int(height)
        Camera.from_opencv(K, R, t, size)  # refuses invalid matrices
        return Calibration(name, K, _lens(_value(table, "dist"), table.get(_MODEL)), R, t, size)


def _matrix(table: Mapping[str, Any], name: str) -> Doubles:
    """Return a matrix (3, 3) of a camera; the rotation is 1 if it is missing."""
    value = _value(table, name)
    if value is None and name == "K":
        refuse(name, "the intrinsic matrix of the camera", "there is none", "Add it")
    return checked_array(name, np.eye(3) if value is None else value, (3, 3), *_BOUNDS)


def _numbers(name: str, value: object) -> Doubles:
    """Return all numbers (n,) of nested lists; raise DermisError for anything else."""
    try:
        numbers: Doubles = np.ravel(np.asarray(value, np.float64))
    except (TypeError, ValueError, OverflowError):
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all():
        refuse(name, "a list of numbers", f"got {format_value(value)}", "Correct it")
    return numbers


def _lens(coefficients: object, model: object) -> Lens:
    """Return the distortion with coefficients of a model, by its name in ROS; None for that of OpenCV."""
    numbers = [] if coefficients is None else _numbers("dist", coefficients).tolist()
    if any(numbers) and model not in (None, *_LENS_MODELS):
        expected, advice = f"one of {', '.join(_LENS_MODELS)}", "Calibrate with the model of OpenCV's pinhole"
        refuse(_MODEL, expected, f"got {format_value(model)}", advice)
    while len(numbers) > len(_LENS_FIELDS) and numbers[-1] == 0.0:
        numbers.pop()
    if len(numbers) > len(_LENS_FIELDS):
        expected = "up to five coefficients k1, k2, p1, p2, k3"
        refuse(
            "dist", expected, f"got {len(numbers)}", "Calibrate without the rational and thin prism models"
        )
    return Lens(**dict(zip(_LENS_FIELDS, numbers, strict=False)))
