"""Readers of landmark files: tables, iBUG's .pts files, and JSON written by MediaPipe or dermis render."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dermis.base.errors import notify, refuse
from dermis.base.reading import parse_json, read_text, refuse_parse_errors
from dermis.base.tables import column_separator, plain_key
from dermis.human.landmarks.sets import LANDMARK_SETS
from dermis.optics.media import Floats

_EXPECTED_FILE_FORMATS = (
    "landmarks as a table of name,x,y or x,y, iBUG's .pts, or JSON of MediaPipe or dermis render"
)
_SETS_BY_LANDMARK_COUNT: Mapping[int, tuple[str, range]] = {
    51: ("ibug-68", range(17, 68)),
    68: ("ibug-68", range(68)),
    70: ("face-synthetics-70", range(70)),
    468: ("mediapipe", range(468)),
    478: ("mediapipe", range(478)),
}
"""Dictionary from the number of landmarks in a file to the name of their landmark set, and to the number of
each landmark within this set, in the order of the file."""
_DETECTOR_FIVE_LANDMARKS = ("face-synthetics-70", (68, 69, 30, 48, 54))
"""Landmark set of the five landmarks of face detectors, and their numbers within this set: the two eyes, the
tip of the nose and the two corners of the mouth. Eyes and corners are ordered from left to right in the
picture."""
_DLIB_FIVE_LANDMARKS = ("ibug-68", (45, 42, 36, 39, 33))
"""Landmark set of the five landmarks of dlib, and their numbers within this set: outer and inner corner of
the eye on the right of the picture, outer and inner corner of the other eye, and base of the nose."""
_MAX_EYE_LINE_DEVIATION = 0.2  # largest distance of dlib's eye corners from a line, relative to their spread
_KNOWN_LANDMARK_COUNTS = ", ".join(map(str, (5, *_SETS_BY_LANDMARK_COUNT)))
_JSON_LIST_KEYS = ("facelandmarks", "multifacelandmarks", "landmarks", "landmark", "value")
_NAME_COLUMNS = ("name", "landmark", "index", "id", "point", "number", "")
_PTS_HEADER_LINE = re.compile(r"(version|n_points)\s*:\s*(\S+)", re.IGNORECASE)
_MAX_RELATIVE_COORDINATE = 2.0  # largest coordinate that is taken as relative to the size of the photograph


class _FileLandmarks(NamedTuple):
    """Landmarks as read from a file.

    pixels : (n, 2) coordinates, NaN for missing landmarks [pixel]
    names : names of the landmarks; None if the file has all landmarks of a known set, in the set's order
    set_name : name of the landmark set; None if the file does not state it
    """

    pixels: Floats
    names: Sequence[str] | None = None
    set_name: str | None = None


def read_landmarks(path: str | Path, photo_size: tuple[int, int]) -> tuple[str, dict[str, Floats]]:
    """Read landmarks in a photograph; return the name of the landmark set and the landmarks' positions.

    The positions are a dictionary from landmark name to pixel coordinates (2,). In the result, the centre of
    the first pixel has the coordinates 0, 0. In .pts files it has 1, 1; this is converted.

    photo_size : width and height of the photograph; relative coordinates are multiplied by it [pixel]

    Raises DermisError for files without landmarks, for unknown sets, and for landmarks outside the
    photograph.
    """
    text = read_text(path, _EXPECTED_FILE_FORMATS)
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    with refuse_parse_errors(
        path, _EXPECTED_FILE_FORMATS, KeyError, TypeError, IndexError, AttributeError, csv.Error
    ):
        if re.match(r'\s*(\[|\{\s*["}])', text):
            points = _landmarks_from_json(path, parse_json(text, path, _EXPECTED_FILE_FORMATS), photo_size)
        elif any(_PTS_HEADER_LINE.fullmatch(line) for line in lines[:3]) or "{" in lines[:3]:
            points = _landmarks_from_pts(path, lines)
        else:
            points = _landmarks_from_table(path, lines, photo_size)
    name, names = _identify_landmarks(path, points)
    found = np.asarray(np.isfinite(points.pixels).all(axis=1))
    if not found.all():
        notify(f"{path}: {len(found) - found.sum()} of {len(found)} landmarks have no position")
    pixels = {one: pixel for one, pixel, has in zip(names, points.pixels, found, strict=True) if has}
    if len(pixels) < 5:
        refuse(path, "at least 5 landmarks with positions", f"got {len(pixels)}", "Correct the file")
    middle = np.median(list(pixels.values()), axis=0)
    if not ((middle >= 0) & (middle < photo_size)).all():
        actual = f"their middle is at {middle[0]:.0f}, {middle[1]:.0f}"
        expected = f"landmarks in the photograph, of {photo_size[0]} x {photo_size[1]} pixels"
        refuse(path, expected, actual, "Use the landmarks of this photograph at this size")
    return name, pixels


def _identify_landmarks(path: str | Path, file_landmarks: _FileLandmarks) -> tuple[str, Sequence[str]]:
    """Return the name of a file's landmark set, and the name in this set of each landmark in the file."""
    count, names = len(file_landmarks.pixels), file_landmarks.names
    if file_landmarks.set_name is not None:
        if file_landmarks.set_name not in LANDMARK_SETS:
            expected = f"landmarks of a known set ({', '.join(LANDMARK_SETS)})"
            refuse(path, expected, f"got {file_landmarks.set_name!r}", "Give one of these")
        return file_landmarks.set_name, names or ()
    if count != 5 and count not in _SETS_BY_LANDMARK_COUNT:
        expected = f"as many landmarks as a known set ({_KNOWN_LANDMARK_COUNTS}), or JSON that names the set"
        refuse(path, expected, f"got {count}", "Give all landmarks of one of these sets")
    if count == 5:
        notify(f"{path}: five landmarks place the camera, but say little about the shape of the face")
    set_name, numbers = (
        _SETS_BY_LANDMARK_COUNT[count]
        if count in _SETS_BY_LANDMARK_COUNT
        else _identify_five_landmarks(file_landmarks.pixels)
    )
    known = [str(number) for number in numbers]
    if names is None or (count > 5 and set(names) == set(known)):
        return set_name, names or known
    start = next((k for k in (0, 1) if {str(k + number) for number in range(count)} == set(names)), None)
    if start is None:
        expected = f"numbers from 0 to {count - 1} as names of the landmarks"
        first = next((name for name in names if names.count(name) > 1 or name not in known), names[0])
        refuse(path, expected, f"got {first!r}", "Correct the names, or leave them out")
    if start == 1:
        notify(f"{path}: its landmarks are numbered from 1; they are taken as those from 0")
    return set_name, [known[int(name) - start] for name in names]


def _identify_five_landmarks(landmark_pixels: Floats) -> tuple[str, Sequence[int]]:
    """Return the landmark set that five points belong to, and the number of each point in this set.

    If the first four points lie on a line, they are the corners of the eyes, as in the files of dlib.
    Otherwise, they are eyes, nose and mouth, as face detectors write them. Files with left and right in
    reverse order are recognised.
    """
    spread = np.linalg.svd(landmark_pixels[:4] - landmark_pixels[:4].mean(axis=0), compute_uv=False)
    is_dlib = bool(spread[1] < _MAX_EYE_LINE_DEVIATION * spread[0])
    right, down = (
        landmark_pixels[0] - landmark_pixels[2] if is_dlib else landmark_pixels[1] - landmark_pixels[0],
        landmark_pixels[4] - landmark_pixels[0],
    )
    is_mirrored = bool(right[0] * down[1] < right[1] * down[0])
    name, numbers = _DLIB_FIVE_LANDMARKS if is_dlib else _DETECTOR_FIVE_LANDMARKS
    order = ((2, 3, 0, 1, 4) if is_dlib else (1, 0, 2, 4, 3)) if is_mirrored else range(5)
    return name, [numbers[k] for k in order]


def _landmarks_from_pts(path: str | Path, text_lines: Sequence[str]) -> _FileLandmarks:
    headers = {
        match[1].lower(): match[2] for line in text_lines if (match := _PTS_HEADER_LINE.fullmatch(line))
    }
    rows = [line.split() for line in text_lines if not _PTS_HEADER_LINE.fullmatch(line) and line not in "{}"]
    count = headers.get("n_points", str(len(rows)))
    if int(count) != len(rows):
        refuse(path, f"{count} points as it states", f"got {len(rows)}", "Correct the file")
    pixels = np.array([[float(x), float(y)] for x, y in rows])
    return _FileLandmarks(pixels - 1.0)


def _landmarks_from_table(
    path: str | Path, text_lines: list[str], photo_size: tuple[int, int]
) -> _FileLandmarks:
    """Return the landmarks of a table, which may have a header.

    The columns are separated by commas, semicolons, tabs or spaces.
    """
    if not text_lines:
        refuse(path, _EXPECTED_FILE_FORMATS, "it is empty", "Find the landmarks again")
    has_separator = re.search("[,;\t]", text_lines[0]) is not None
    cells = (
        csv.reader(text_lines, delimiter=column_separator(text_lines[0]))
        if has_separator
        else map(str.split, text_lines)
    )
    rows = [[cell.strip() for cell in row] for row in cells]
    if not any(map(_is_number, rows[0][1:])):
        return _landmarks_from_named_columns(path, rows[0], rows[1:], photo_size)
    if len(rows) == 1:  # all coordinates in one line
        rows = [rows[0][k : k + 2] for k in range(0, len(rows[0]), 2)]
    first = [row[0] for row in rows]
    has_names = len(rows[0]) > 2 and (not all(map(_is_number, first)) or _are_consecutive_numbers(first))
    start = 1 if has_names else 0
    if len(rows[0]) > start + 2:
        notify(f"{path}: of its {len(rows[0])} columns those from {start + 3} on are not used")
    pixels = np.array([[_parse_number(cell) for cell in row[start : start + 2]] for row in rows])
    return _FileLandmarks(_to_pixels(path, pixels, photo_size), first if has_names else None)


def _landmarks_from_named_columns(
    path: str | Path, header: Sequence[str], table_rows: list[list[str]], photo_size: tuple[int, int]
) -> _FileLandmarks:
    """Return the landmarks of a table with columns x, y and name, or x_0, y_0, x_1, ... as in OpenFace."""
    if "x_0" in header:
        if len(table_rows) > 1:
            notify(f"{path}: the first of its {len(table_rows)} rows is used")
        count = sum(re.fullmatch(r"x_\d+", name) is not None for name in header)
        columns = [[header.index(f"{axis}_{k}") for axis in "xy"] for k in range(count)]
        pixels = np.array([[_parse_number(table_rows[0][column]) for column in pair] for pair in columns])
        return _FileLandmarks(_to_pixels(path, pixels, photo_size))
    keys = [plain_key(name) for name in header]
    if not {"x", "y"} <= set(keys):
        refuse(
            path, _EXPECTED_FILE_FORMATS, f"its columns are {', '.join(header)}", "Name two columns x and y"
        )
    x, y = keys.index("x"), keys.index("y")
    name = next((keys.index(key) for key in _NAME_COLUMNS if key in keys), None)
    unused = [header[k] for k in range(len(header)) if k not in (x, y, name)]
    if unused:
        notify(f"{path}: its columns {', '.join(unused)} are not used")
    pixels = np.array([[_parse_number(row[x]), _parse_number(row[y])] for row in table_rows])
    return _FileLandmarks(
        _to_pixels(path, pixels, photo_size), None if name is None else [row[name] for row in table_rows]
    )


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(_parse_number(cell))
    except ValueError:
        return False


def _are_consecutive_numbers(text_cells: Sequence[str]) -> bool:
    """Return whether the cells are 0, 1, 2 and so on, or 1, 2, 3 and so on."""
    return any(list(text_cells) == [str(k + start) for k in range(len(text_cells))] for start in (0, 1))


def _parse_number(cell: str) -> float:
    return float(cell.replace(",", ".") or "nan")


def _to_pixels(path: str | Path, coordinates: Floats, photo_size: tuple[int, int]) -> Floats:
    """Return coordinates (n, 2) in pixels.

    Small coordinates are taken as relative to the size of the photograph; the user is notified of this.
    """
    if coordinates.ndim != 2 or not np.nanmax(np.abs(coordinates), initial=0.0) <= _MAX_RELATIVE_COORDINATE:
        return coordinates
    notify(f"{path}: its coordinates are taken as relative to the size of the photograph")
    return np.asarray(coordinates * photo_size - 0.5)


def _landmarks_from_json(path: str | Path, json_value: Any, photo_size: tuple[int, int]) -> _FileLandmarks:
    """Return the landmarks in JSON that was written by `dermis render --landmarks` or by MediaPipe."""
    if (
        isinstance(json_value, Mapping)
        and isinstance(json_value.get("landmarks"), Mapping)
        and json_value["landmarks"]
    ):
        name, rows = next(iter(json_value["landmarks"].items()))
        pixels = np.array([row["pixel"] for row in rows], np.float64)
        return _FileLandmarks(pixels, [str(row["name"]) for row in rows], name)
    while not (isinstance(json_value, list) and json_value and _is_point(json_value[0])):
        fields = (
            {plain_key(key): value for key, value in json_value.items()}
            if isinstance(json_value, Mapping)
            else {}
        )
        key = next((key for key in _JSON_LIST_KEYS if key in fields), None)
        if key is not None:
            json_value = fields[key]
        elif isinstance(json_value, list) and json_value:
            if len(json_value) > 1:
                notify(f"{path}: the first of its {len(json_value)} faces is used")
            json_value = json_value[0]
        else:
            refuse(path, _EXPECTED_FILE_FORMATS, "no face was found in it", "Find the landmarks again")
    if isinstance(json_value[0], list):
        return _FileLandmarks(
            _to_pixels(path, np.array([point[:2] for point in json_value], np.float64), photo_size)
        )
    points = np.array([[point["x"], point["y"]] for point in json_value], np.float64)
    is_relative = np.abs(points).max() <= _MAX_RELATIVE_COORDINATE
    return _FileLandmarks(points * photo_size - 0.5 if is_relative else points)


def _is_point(json_value: object) -> bool:
    """Return whether a value is a point: an object with x and y, or a list of numbers."""
    if isinstance(json_value, list):
        return len(json_value) in (2, 3) and all(type(number) in (int, float) for number in json_value)
    return isinstance(json_value, Mapping) and "x" in json_value and "y" in json_value
