"""Captures of Live Link Face: CSV files of ARKit blend shape weights and rotations of head and eyes."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.base.reading import parsing, read_text
from dermis.formats.motion.captures import (
    MAX_CLIP_BYTES,
    CaptureSamples,
    RotationBones,
    capture_clip,
    check_size,
    check_weights,
    find_rotation_bones,
    head_bone_angles,
    unwrap_degrees,
)
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.rotations import angles_matrix, matrix_quaternion

_TIME_COLUMN, _COUNT_COLUMN = "timecode", "blendshapecount"
_ROTATED_OBJECTS = ("head", "lefteye", "righteye")
_ANGLE_COLUMNS = {f"{part}{angle}" for part in _ROTATED_OBJECTS for angle in ("pitch", "yaw", "roll")}
_TIMECODE = re.compile(r"(\d{1,3}):(\d{1,2}):(\d{1,2})[:;](\d{1,4}(?:\.\d{1,12})?)")
_TIMECODE_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0, 240.0)
_APP_RATE = 60.0
_DAY_S, _MIDNIGHT_S = 86400.0, 82800.0


class _Timecode(NamedTuple):
    """Timecode of a frame: whole seconds since midnight, and frames after the last whole second."""

    seconds: int
    frames: float


class _CaptureTable(NamedTuple):
    """Numeric columns of a capture: n column names, and times [s] and values (k, n) of k rows."""

    names: list[str]
    times_s: Doubles
    values: Doubles


def load_live_link(path: Path, head: Head, fps: float | None = None) -> Clip:
    """Load a CSV file of Live Link Face as a clip for a head.

    Columns are identified by name, in any order: Timecode, blend shapes, and angles [rad] HeadPitch, HeadYaw
    and HeadRoll about the head's x, y and z axes, likewise LeftEye... and RightEye.... They rotate the bones
    found by `find_rotation_bones`.

    fps : frame rate of the timecode; by default estimated from its largest frame number

    Raises DermisError for a file with other columns or invalid lines, which it names.
    """
    table = _read_table(path, fps)
    shapes = [k for k, name in enumerate(table.names) if name.casefold() not in _ANGLE_COLUMNS]
    bones = find_rotation_bones(head.control.skeleton)
    angles, unused = _bone_angles(table, bones)
    names = tuple(table.names[k] for k in shapes)
    samples = CaptureSamples(table.times_s, names, table.values[:, shapes], angles, unused)
    return capture_clip(path, path.stem, samples, head)


def _read_table(path: Path, fps: float | None) -> _CaptureTable:
    expected = "a CSV of Live Link Face"
    reader = csv.reader(io.StringIO(read_text(path, expected, MAX_CLIP_BYTES), newline=""))
    with parsing(path, expected, csv.Error):
        header = [cell.strip() for cell in next(filter(_has_text, reader), [])]
        if not header:
            refuse(path, f"{expected} with a header and rows", "it is empty", "Export it again")
        _check_header(f"{path}, line {reader.line_num}", header)
        folded = [name.casefold() for name in header]
        columns = [k for k, name in enumerate(folded) if name not in (_TIME_COLUMN, _COUNT_COLUMN, "")]
        lines: list[int] = []
        codes: list[_Timecode] = []
        rows: list[Doubles] = []
        for row in filter(_has_text, reader):
            culprit = f"{path}, line {reader.line_num}"
            _check_row(culprit, header, row)
            lines.append(reader.line_num)
            codes.append(_timecode(culprit, row[folded.index(_TIME_COLUMN)]))
            rows.append(_row_values(culprit, header, row, columns))
            check_size(path, len(rows), len(columns))
    if not rows:
        refuse(path, f"{expected} with a header and rows", "it has only its header", "Export it again")
    times = _row_times(path, lines, codes, fps)
    return _CaptureTable([header[k] for k in columns], times, np.array(rows))


def _has_text(row: Sequence[str]) -> bool:
    return any(map(str.strip, row))


def _check_row(culprit: str, header: Sequence[str], row: Sequence[str]) -> None:
    if len(row) < len(header) or any(cell.strip() for cell in row[len(header) :]):
        refuse(culprit, f"{len(header)} cells", f"got {len(row)}", "Correct or remove the line")


def _check_header(culprit: str, header: Sequence[str]) -> None:
    check_size(culprit, 0, len(header))
    folded = [name.casefold() for name in header if name]
    if _TIME_COLUMN not in folded:
        actual = f"the columns are {', '.join(header[:5])}{' ...' if len(header) > 5 else ''}"
        refuse(culprit, "a column Timecode", actual, "Export it from Live Link Face as it is")
    repeated = [name for name in header if name and folded.count(name.casefold()) > 1]
    if repeated:
        refuse(culprit, "each column once", f"{repeated[0]} occurs twice", "Remove one of them")
    if not set(folded) - {_TIME_COLUMN, _COUNT_COLUMN}:
        refuse(culprit, "columns of blend shapes", "there are none", "Export it from Live Link Face as it is")


def _row_values(culprit: str, header: Sequence[str], row: Sequence[str], columns: Sequence[int]) -> Doubles:
    values = np.zeros(len(columns))
    for index, column in enumerate(columns):
        try:
            values[index] = float(row[column])
        except ValueError:
            actual = f"{header[column]} is {row[column]!r}"
            refuse(culprit, "numbers", actual, "Correct or remove the line")
    check_weights(culprit, [header[column] for column in columns], values)
    return values


def _timecode(culprit: str, cell: str) -> _Timecode:
    match = _TIMECODE.fullmatch(cell.strip())
    if match is None:
        refuse(culprit, "a Timecode as HH:MM:SS:FF.fff", f"got {cell!r}", "Correct or remove the line")
    hours, minutes, seconds = (int(match[k]) for k in (1, 2, 3))
    return _Timecode(3600 * hours + 60 * minutes + seconds, float(match[4]))


def _row_times(path: Path, lines: Sequence[int], codes: Sequence[_Timecode], fps: float | None) -> Doubles:
    """Return the time of each row [s]; times continue to increase when the timecode passes midnight.

    lines : line number of each row in the file, for errors
    codes : timecode of each row
    fps : frame rate of the timecode; None to estimate it
    """
    rate = fps or _timecode_rate(codes)
    times = np.array([code.seconds + code.frames / rate for code in codes])
    days = np.cumsum(np.diff(times, prepend=times[0]) < -_MIDNIGHT_S)
    times += _DAY_S * days
    backwards = np.flatnonzero(np.diff(times) < 0)
    if len(backwards):
        row = int(backwards[0]) + 1
        actual = f"this line is {times[row - 1] - times[row]:.3f} s before the previous one"
        culprit = f"{path}, line {lines[row]}"
        refuse(culprit, "increasing Timecodes", actual, "Sort the lines, or remove this one")
    return times


def _timecode_rate(codes: Sequence[_Timecode]) -> float:
    """Estimate the frame rate of timecodes: the lowest common rate above the largest frame number.

    If no full second was recorded, the rate is at least that of the app, 60.
    """
    largest = max(int(code.frames) for code in codes)
    seconds_advance = any(after.seconds > before.seconds for before, after in pairwise(codes))
    fitting = [rate for rate in _TIMECODE_RATES if rate > largest] or [float(largest + 1)]
    return fitting[0] if seconds_advance else max(_APP_RATE, fitting[0])


def _bone_angles(table: _CaptureTable, bones: RotationBones) -> tuple[dict[str, Doubles], tuple[str, ...]]:
    """Return angles (k, 3) by bone name [degrees], and the angle columns for which the head has no bone."""
    columns = {name.casefold(): k for k, name in enumerate(table.names)}
    angles: dict[str, Doubles] = {}
    unused: list[str] = []
    for part in _ROTATED_OBJECTS:
        part_columns = {angle: columns.get(f"{part}{angle}") for angle in ("pitch", "yaw", "roll")}
        if all(column is None for column in part_columns.values()):
            continue
        used = part_columns.values()
        rows = np.degrees([[0.0 if k is None else row[k] for k in used] for row in table.values])
        eye = bones.eyes.get(part.removesuffix("eye")) if part != "head" else None
        if eye is not None:
            angles[eye] = unwrap_degrees(rows)
        elif part == "head" and bones.head:
            rotations = matrix_quaternion(np.array([angles_matrix(row) for row in rows.tolist()]))
            angles |= head_bone_angles(bones, rotations)
        elif rows.any():
            unused += [table.names[k] for k in part_columns.values() if k is not None]
    return angles, tuple(unused)
