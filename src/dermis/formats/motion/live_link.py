"""Captures of Live Link Face: a CSV of ARKit's blend shapes and the angles of head and eyes."""

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

_TIME, _COUNT = "timecode", "blendshapecount"
_PARTS = ("head", "lefteye", "righteye")
_ANGLES = {f"{part}{angle}" for part in _PARTS for angle in ("pitch", "yaw", "roll")}
_TIMECODE = re.compile(r"(\d{1,3}):(\d{1,2}):(\d{1,2})[:;](\d{1,4}(?:\.\d{1,12})?)")
_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0, 240.0)
_APP_RATE = 60.0
_DAY_S, _MIDNIGHT_S = 86400.0, 82800.0


class _Timecode(NamedTuple):
    """Whole seconds, and frames after them."""

    seconds: int
    frames: float


class _Table(NamedTuple):
    """names of the columns, times [s] and numbers (k, n) of the rows."""

    names: list[str]
    times_s: Doubles
    values: Doubles


def load_live_link(path: Path, head: Head, fps: float | None = None) -> Clip:
    """The clip that a CSV of Live Link Face is for a head.

    Columns count by their names, in any order: Timecode, blend shapes, and angles [rad] HeadPitch, HeadYaw
    and HeadRoll, about the head's x, y and z, likewise LeftEye... and RightEye..., for which
    `find_rotation_bones` tells the bones.

    fps : frames a second of the timecode; when left out, what the largest of its frames tells

    Raises DermisError for a file with other columns or broken lines, which it names.
    """
    table = _read(path, fps)
    shapes = [k for k, name in enumerate(table.names) if name.casefold() not in _ANGLES]
    bones = find_rotation_bones(head.control.skeleton)
    angles, lost = _bone_angles(table, bones)
    names = tuple(table.names[k] for k in shapes)
    samples = CaptureSamples(table.times_s, names, table.values[:, shapes], angles, lost)
    return capture_clip(path, path.stem, samples, head)


def _read(path: Path, fps: float | None) -> _Table:
    expected = "a CSV of Live Link Face"
    reader = csv.reader(io.StringIO(read_text(path, expected, MAX_CLIP_BYTES), newline=""))
    with parsing(path, expected, csv.Error):
        header = [cell.strip() for cell in next(filter(_has_text, reader), [])]
        if not header:
            refuse(path, f"{expected} with a header and rows", "it is empty", "Export it again")
        _check_header(f"{path}, line {reader.line_num}", header)
        folded = [name.casefold() for name in header]
        kept = [k for k, name in enumerate(folded) if name not in (_TIME, _COUNT, "")]
        lines: list[int] = []
        codes: list[_Timecode] = []
        rows: list[Doubles] = []
        for row in filter(_has_text, reader):
            culprit = f"{path}, line {reader.line_num}"
            _check_row(culprit, header, row)
            lines.append(reader.line_num)
            codes.append(_timecode(culprit, row[folded.index(_TIME)]))
            rows.append(_numbers(culprit, header, row, kept))
            check_size(path, len(rows), len(kept))
    if not rows:
        refuse(path, f"{expected} with a header and rows", "it has only its header", "Export it again")
    times = _row_times(path, lines, codes, fps)
    return _Table([header[k] for k in kept], times, np.array(rows))


def _has_text(row: Sequence[str]) -> bool:
    return any(map(str.strip, row))


def _check_row(culprit: str, header: Sequence[str], row: Sequence[str]) -> None:
    if len(row) < len(header) or any(cell.strip() for cell in row[len(header) :]):
        refuse(culprit, f"{len(header)} cells", f"got {len(row)}", "Correct or remove the line")


def _check_header(culprit: str, header: Sequence[str]) -> None:
    check_size(culprit, 0, len(header))
    folded = [name.casefold() for name in header if name]
    if _TIME not in folded:
        actual = f"the columns are {', '.join(header[:5])}{' ...' if len(header) > 5 else ''}"
        refuse(culprit, "a column Timecode", actual, "Export it from Live Link Face as it is")
    twice = [name for name in header if name and folded.count(name.casefold()) > 1]
    if twice:
        refuse(culprit, "each column once", f"{twice[0]} comes twice", "Remove one of them")
    if not set(folded) - {_TIME, _COUNT}:
        refuse(culprit, "columns of blend shapes", "there are none", "Export it from Live Link Face as it is")


def _numbers(culprit: str, header: Sequence[str], row: Sequence[str], kept: Sequence[int]) -> Doubles:
    values = np.zeros(len(kept))
    for place, column in enumerate(kept):
        try:
            values[place] = float(row[column])
        except ValueError:
            actual = f"{header[column]} is {row[column]!r}"
            refuse(culprit, "numbers", actual, "Correct or remove the line")
    check_weights(culprit, [header[column] for column in kept], values)
    return values


def _timecode(culprit: str, cell: str) -> _Timecode:
    match = _TIMECODE.fullmatch(cell.strip())
    if match is None:
        refuse(culprit, "a Timecode as HH:MM:SS:FF.fff", f"got {cell!r}", "Correct or remove the line")
    hours, minutes, seconds = (int(match[k]) for k in (1, 2, 3))
    return _Timecode(3600 * hours + 60 * minutes + seconds, float(match[4]))


def _row_times(path: Path, lines: Sequence[int], codes: Sequence[_Timecode], fps: float | None) -> Doubles:
    """Seconds of each row; a timecode that goes from 23 to 0 hours goes on."""
    rate = fps or _rate(codes)
    times = np.array([one.seconds + one.frames / rate for one in codes])
    days = np.cumsum(np.diff(times, prepend=times[0]) < -_MIDNIGHT_S)
    times += _DAY_S * days
    back = np.flatnonzero(np.diff(times) < 0)
    if len(back):
        row = int(back[0]) + 1
        actual = f"this line is {times[row - 1] - times[row]:.3f} s before the last"
        refuse(
            f"{path}, line {lines[row]}",
            "a Timecode that goes on",
            actual,
            "Sort the lines, or remove this one",
        )
    return times


def _rate(codes: Sequence[_Timecode]) -> float:
    """Frames a second: the least usual rate beyond the largest frame, once a whole second went by."""
    largest = max(int(one.frames) for one in codes)
    turned = any(after.seconds > before.seconds for before, after in pairwise(codes))
    fitting = [rate for rate in _RATES if rate > largest] or [float(largest + 1)]
    return fitting[0] if turned else max(_APP_RATE, fitting[0])


def _bone_angles(table: _Table, bones: RotationBones) -> tuple[dict[str, Doubles], tuple[str, ...]]:
    """Angles (k, 3) [degrees] of bones, and names of columns for which the head has no bone."""
    columns = {name.casefold(): k for k, name in enumerate(table.names)}
    angles: dict[str, Doubles] = {}
    lost: list[str] = []
    for part in _PARTS:
        own = {angle: columns.get(f"{part}{angle}") for angle in ("pitch", "yaw", "roll")}
        if all(column is None for column in own.values()):
            continue
        rows = np.degrees([[0.0 if k is None else row[k] for k in own.values()] for row in table.values])
        eye = bones.eyes.get(part.removesuffix("eye")) if part != "head" else None
        if eye is not None:
            angles[eye] = unwrap_degrees(rows)
        elif part == "head" and bones.head:
            turns = matrix_quaternion(np.array([angles_matrix(row) for row in rows.tolist()]))
            angles |= head_bone_angles(bones, turns)
        elif rows.any():
            lost += [table.names[k] for k in own.values() if k is not None]
    return angles, tuple(lost)
