"""Captures of Live Link Face: CSV files of ARKit blend shape weights and rotations of head and eyes."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Mask
from dermis.base.errors import notify, refuse
from dermis.base.quantities import checked_number
from dermis.base.reading import read_text, refuse_parse_errors
from dermis.base.tables import column_separator, plain_key
from dermis.formats.motion.captures import (
    FRAME_NUMBER_KEYS,
    MAX_CLIP_BYTES,
    MAX_STATED_TIME,
    NEUTRAL_SHAPE_NAME,
    SECONDS_PER_TIME_KEY,
    CaptureSamples,
    RotationBones,
    capture_clip,
    check_capture_size,
    check_weights,
    fill_gaps,
    find_rotation_bones,
    frame_rate_or_default,
    head_bone_angles,
    note_lost_frames,
    to_seconds,
    unwrap_degrees,
    weights_as_fractions,
)
from dermis.mesh.clip import Clip
from dermis.mesh.head import Head
from dermis.mesh.rotations import angles_matrix, matrix_quaternion

_SHAPE_COUNT_COLUMN = "blendshapecount"
_TIME_COLUMNS: Mapping[str, float | None] = {"timecode": None, **SECONDS_PER_TIME_KEY}
_COLUMNS_WITHOUT_MOTION = (
    *_TIME_COLUMNS,
    *FRAME_NUMBER_KEYS,
    _SHAPE_COUNT_COLUMN,
    plain_key(NEUTRAL_SHAPE_NAME),
    "",
)
_ROTATED_OBJECTS = ("head", "lefteye", "righteye")
_ANGLE_COLUMNS = [f"{part}{angle}" for part in _ROTATED_OBJECTS for angle in ("pitch", "yaw", "roll")]
_TIMECODE_PATTERN = re.compile(
    r"(\d{1,3}):(\d{1,2}):(\d{1,2}(?:\.\d{1,12})?)(?:[:;](\d{1,4}(?:\.\d{1,12})?))?", re.ASCII
)
_TIMECODE_FRAME_RATES = (24.0, 25.0, 30.0, 48.0, 50.0, 60.0, 100.0, 120.0, 240.0)
_APP_FRAME_RATE = 60.0
_SECONDS_PER_DAY = 86400.0
_MIN_FALL_AT_MIDNIGHT_S = 82800.0  # a timecode that falls by more has passed midnight
_MAX_ANGLE_RADIANS = 2 * np.pi  # largest angle of a head in radians; larger angles are taken as degrees


class _Timecode(NamedTuple):
    """Timecode of a frame: full seconds since midnight, and number of the frame within the second."""

    seconds: float
    frames: float


class _CaptureTable(NamedTuple):
    """Numeric columns of a capture: n column names, and times [s] and values (k, n) of k rows."""

    names: list[str]
    times_s: Doubles
    values: Doubles


def load_live_link(path: Path, head: Head, fps: float | None = None) -> Clip:
    """Load a CSV file of Live Link Face as a clip for a head.

    Columns are separated by commas, semicolons or tabs, and identified by name, in any order. They contain
    the Timecode or another time, the weights of blend shapes, and angles [rad]. HeadPitch, HeadYaw and
    HeadRoll are the angles about the head's x, y and z axes; LeftEyePitch and similar columns are the angles
    of the eyes. The angles rotate the bones found by `find_rotation_bones`. Empty cells and frames without a
    face are interpolated; weights in percent and angles in degrees are converted. Notes tell the user of such
    changes.

    fps : frame rate of the timecode; by default estimated from its largest frame number

    Raises DermisError for a file with other columns and for invalid lines; the message names the line.
    """
    table = _read_table(path, fps)
    is_angle = np.array([plain_key(name) in _ANGLE_COLUMNS for name in table.names])
    bones = find_rotation_bones(head.control_rig.skeleton)
    angles, unused = _bone_angles(table, bones)
    names = tuple(name for name, angle in zip(table.names, is_angle, strict=True) if not angle)
    samples = CaptureSamples(table.times_s, names, table.values[:, ~is_angle], angles, unused)
    return capture_clip(path, path.stem, samples, head)


def _read_table(path: Path, fps: float | None) -> _CaptureTable:
    expected = "a CSV of Live Link Face"
    text = read_text(path, expected, MAX_CLIP_BYTES)
    separator = column_separator(next(filter(str.strip, io.StringIO(text)), ""))
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    with refuse_parse_errors(path, expected, csv.Error):
        header = [cell.strip() for cell in next(filter(_has_text, reader), [])]
        if not header:
            refuse(path, f"{expected} with a header and rows", "it is empty", "Export it again")
        _check_header(f"{path}, line {reader.line_num}", header)
        keys = [plain_key(name) for name in header]
        columns = [k for k, key in enumerate(keys) if key not in _COLUMNS_WITHOUT_MOTION]
        time = next((keys.index(key) for key in (*_TIME_COLUMNS, *FRAME_NUMBER_KEYS) if key in keys), None)
        count = keys.index(_SHAPE_COUNT_COLUMN) if _SHAPE_COUNT_COLUMN in keys else None
        lines, times, rows, states_shapes = [], [], [], []
        for row in filter(_has_text, reader):
            error_subject = f"{path}, line {reader.line_num}"
            _check_row(error_subject, header, row, count)
            lines.append(error_subject)
            times.append("" if time is None else row[time].strip().replace(",", "."))
            states_shapes.append(count is not None and row[count].strip() not in ("", "0"))
            rows.append(_row_values(error_subject, header, row, columns))
            check_capture_size(path, len(rows), len(columns))
    if not rows:
        refuse(path, f"{expected} with a header and rows", "it has only its header", "Export it again")
    times_s = _row_times(path, lines, times, None if time is None else keys[time], fps)
    names = [header[k] for k in columns]
    table = _CaptureTable(names, times_s, np.array(rows))
    return _fill_table_gaps(path, lines, table, np.array(states_shapes))


def _has_text(table_row: Sequence[str]) -> bool:
    return any(map(str.strip, table_row))


def _check_row(
    error_subject: str, header: Sequence[str], table_row: list[str], count_column: int | None
) -> None:
    """Refuse a row with too many or too few cells.

    A row whose number of blend shapes is 0 may be too short; empty cells are appended to it.

    count_column : index of the column that states the number of blend shapes; None if there is none
    """
    if (
        count_column is not None
        and count_column < len(table_row) < len(header)
        and table_row[count_column].strip() == "0"
    ):
        table_row += [""] * (len(header) - len(table_row))
    if len(table_row) < len(header) or any(cell.strip() for cell in table_row[len(header) :]):
        refuse(error_subject, f"{len(header)} cells", f"got {len(table_row)}", "Correct or remove the line")


def _check_header(error_subject: str, header: Sequence[str]) -> None:
    check_capture_size(error_subject, 0, len(header))
    folded = [name.casefold() for name in header if name]
    repeated = [name for name in header if name and folded.count(name.casefold()) > 1]
    if repeated:
        refuse(error_subject, "each column once", f"{repeated[0]} occurs twice", "Remove one of them")
    if all(plain_key(name) in _COLUMNS_WITHOUT_MOTION for name in header):
        refuse(
            error_subject,
            "columns of blend shapes",
            "there are none",
            "Export it from Live Link Face without changes",
        )


def _row_values(
    error_subject: str, header: Sequence[str], table_row: Sequence[str], column_indices: Sequence[int]
) -> Doubles:
    """Return the values of the columns `column_indices` of a row; empty cells are NaN.

    Numbers may have a decimal comma.
    """
    values = np.full(len(column_indices), np.nan)
    for index, column in enumerate(column_indices):
        cell = table_row[column].strip()
        try:
            values[index] = float(cell.replace(",", ".") or "nan")
        except ValueError:
            refuse(error_subject, "numbers", f"{header[column]} is {cell!r}", "Correct or remove the line")
    return values


def _fill_table_gaps(
    path: Path, line_numbers: list[str], capture_table: _CaptureTable, has_shape_count: Mask
) -> _CaptureTable:
    """Return a capture with weights as fractions, angles in radians, and missing values interpolated.

    Values are missing in empty cells and in frames without a face. Columns without any value are left out.

    path : file of the capture, for notes
    line_numbers : file and line of each row, for errors
    capture_table : columns of the capture, with NaN for empty cells
    has_shape_count : (k,) mask of rows that state a number of blend shapes above 0
    """
    values, names = capture_table.values, capture_table.names
    is_angle = np.array([plain_key(name) in _ANGLE_COLUMNS for name in names])
    lost = _rows_without_face(values, is_angle, has_shape_count)
    values[lost] = np.nan
    empty = np.asarray(np.isnan(values).all(axis=0))
    if empty.all():
        refuse(path, "frames with a face", "all rows are empty", "Record it again")
    if empty.any():
        left_out = ", ".join(name for name, none in zip(names, empty, strict=True) if none)
        notify(f"{path}: columns without values are left out: {left_out}")
    names, values, is_angle = [names[k] for k in np.flatnonzero(~empty)], values[:, ~empty], is_angle[~empty]
    note_lost_frames(path, int(lost.sum()), len(lost))
    if cells := np.isnan(values[~lost]).sum():
        notify(f"{path}: {cells} empty cells are interpolated between those of other frames")
    values[:, ~is_angle] = weights_as_fractions(path, values[:, ~is_angle])
    if np.nanmax(np.abs(values[:, is_angle]), initial=0.0) > _MAX_ANGLE_RADIANS:
        notify(f"{path}: its angles are taken as degrees")
        values[:, is_angle] = np.radians(values[:, is_angle])
    check_weights(line_numbers, names, values)
    return _CaptureTable(names, capture_table.times_s, fill_gaps(capture_table.times_s, values))


def _rows_without_face(cell_values: Doubles, is_angle: Mask, has_shape_count: Mask) -> Mask:
    """Return the mask (k,) of rows without a face: rows of empty cells, and certain rows of zeros.

    A row of zeros has no face if most other rows contain rotations. It also has no face if other rows state
    a number of blend shapes above 0 and this row does not.

    cell_values : (k, n) values of the cells, NaN for empty cells
    is_angle : (n,) mask of the columns that contain angles
    has_shape_count : (k,) mask of rows that state a number of blend shapes above 0
    """
    numbers = np.nan_to_num(cell_values)
    zero = np.asarray(~numbers.any(axis=1))
    turned = np.asarray(numbers[:, is_angle].any(axis=1))
    always_turned = bool(turned[~zero].sum() > 0.5 * (~zero).sum())
    unstated = ~has_shape_count & has_shape_count.any()
    return np.asarray(np.isnan(cell_values).all(axis=1)) | (zero & (always_turned | unstated))


def _row_times(
    path: Path, line_numbers: list[str], time_cells: list[str], time_column: str | None, fps: float | None
) -> Doubles:
    """Return the time of each row [s]; times continue to increase when the timecode passes midnight.

    line_numbers : file and line of each row, for errors
    time_cells : time of each row: a timecode or a number, as text
    time_column : normalised name of the column of times or frame numbers; None if there is no such column
    fps : frame rate of the timecode; None to estimate it
    """
    if time_column is None:
        return np.arange(len(line_numbers)) / frame_rate_or_default(path, fps, _APP_FRAME_RATE)
    if any(":" in cell for cell in time_cells):
        codes = [_parse_timecode(line, cell) for line, cell in zip(line_numbers, time_cells, strict=True)]
        rate = fps or _timecode_rate(codes)
        times = np.array([code.seconds + code.frames / rate for code in codes])
        days = np.cumsum(np.diff(times, prepend=times[0]) < -_MIN_FALL_AT_MIDNIGHT_S)
        times += _SECONDS_PER_DAY * days
    else:
        times = np.array(
            [_parse_time(line, cell) for line, cell in zip(line_numbers, time_cells, strict=True)]
        )
        if time_column in FRAME_NUMBER_KEYS:
            times = times / frame_rate_or_default(path, fps, _APP_FRAME_RATE)
        else:
            times = to_seconds(path, times, _TIME_COLUMNS[time_column])
    backwards = np.flatnonzero(np.diff(times) < 0)
    if len(backwards):
        row = int(backwards[0]) + 1
        actual = f"this line is {times[row - 1] - times[row]:.3f} s before the previous one"
        refuse(line_numbers[row], "increasing Timecodes", actual, "Sort the lines, or remove this one")
    return times


def _parse_timecode(error_subject: str, timecode_cell: str) -> _Timecode:
    match = _TIMECODE_PATTERN.fullmatch(timecode_cell)
    if match is None:
        refuse(
            error_subject,
            "a Timecode as HH:MM:SS:FF.fff",
            f"got {timecode_cell!r}",
            "Correct or remove the line",
        )
    hours, minutes, seconds, frames = match.groups(default="0")
    return _Timecode(3600 * int(hours) + 60 * int(minutes) + float(seconds), float(frames))


def _parse_time(error_subject: str, time_cell: str) -> float:
    try:
        return checked_number(error_subject, float(time_cell), -MAX_STATED_TIME, MAX_STATED_TIME)
    except ValueError:
        actual = f"got {time_cell!r}"
        refuse(
            error_subject, "a Timecode as HH:MM:SS:FF.fff, or a number", actual, "Correct or remove the line"
        )


def _timecode_rate(timecodes: Sequence[_Timecode]) -> float:
    """Estimate the frame rate of timecodes from the largest number of a frame within its second.

    The estimate is the lowest standard rate (24, 25, 30, 48, 50, 60, ...) above this number. If all timecodes
    are in the same second, the estimate is at least 60, the frame rate of Live Link Face.
    """
    largest = max(int(code.frames) for code in timecodes)
    seconds_advance = any(after.seconds > before.seconds for before, after in pairwise(timecodes))
    fitting = [rate for rate in _TIMECODE_FRAME_RATES if rate > largest] or [float(largest + 1)]
    return fitting[0] if seconds_advance else max(_APP_FRAME_RATE, fitting[0])


def _bone_angles(
    capture_table: _CaptureTable, bones: RotationBones
) -> tuple[dict[str, Doubles], tuple[str, ...]]:
    """Return the angles (k, 3) of bones by bone name [degrees], and the angle columns without a bone."""
    columns = {plain_key(name): k for k, name in enumerate(capture_table.names)}
    angles: dict[str, Doubles] = {}
    unused: list[str] = []
    for part in _ROTATED_OBJECTS:
        part_columns = {angle: columns.get(f"{part}{angle}") for angle in ("pitch", "yaw", "roll")}
        if all(column is None for column in part_columns.values()):
            continue
        used = part_columns.values()
        rows = np.degrees([[0.0 if k is None else row[k] for k in used] for row in capture_table.values])
        eye = bones.eyes.get(part.removesuffix("eye")) if part != "head" else None
        if eye is not None:
            angles[eye] = unwrap_degrees(rows)
        elif part == "head" and bones.head:
            rotations = matrix_quaternion(np.array([angles_matrix(row) for row in rows.tolist()]))
            angles |= head_bone_angles(bones, rotations)
        elif rows.any():
            unused += [capture_table.names[k] for k in part_columns.values() if k is not None]
    return angles, tuple(unused)
