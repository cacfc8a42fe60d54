"""Captures of MediaPipe's face landmarker: one result per frame in JSON, as MediaPipe returns it."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from itertools import chain, pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Intp
from dermis.base.errors import DermisError, format_value, notify, refuse
from dermis.base.quantities import checked_array, checked_number
from dermis.base.reading import parse_json, read_text
from dermis.base.tables import plain_key
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
    rotation_quaternions,
    to_seconds,
    weights_as_fractions,
)
from dermis.mesh.clip import Clip, check_frame_rate
from dermis.mesh.head import Head

_SHAPE_KEYS = ("blendshapes", "faceblendshapes")
_MATRIX_KEYS = (
    "matrix",
    "facialtransformationmatrix",
    "facialtransformationmatrixes",
    "facialtransformationmatrices",
)
_FACE_KEYS = ("faces", "landmarks", "facelandmarks")
"""Keys (see `plain_key`) of lists with one entry for each face; such a list is not a list of frames."""
_CATEGORY_LIST_KEYS = ("categories", "classification")
_MATRIX_DATA_KEYS = ("data", "packeddata", "value")
_NAME_KEYS = ("categoryname", "label", "name", "displayname")
_SCORE_KEYS = ("score", "value", "weight")
_FRAME_RATE_KEYS = ("fps", "framerate")
_DEFAULT_FRAME_RATE = 30.0
_MAX_MATRIX_VALUE = 1e6
_EXPECTED_CONTENT = "results of MediaPipe in JSON"
_LINE_ADVICE = "Correct or remove the line"
_RECORD_ADVICE = "Record with output_face_blendshapes (JavaScript: outputFaceBlendshapes) set to true"


class _CapturedFrame(NamedTuple):
    """Blend shape weights of one captured frame.

    error_subject : file with line or number of the frame, for errors
    number : number of the frame
    time : time of the frame, in the unit `unit`; NaN if the frame has none
    unit : unit of the time [s]; None if it is not stated
    columns : (n,) indices of the frame's blend shapes among the blend shapes of all frames; empty if there is
        no face
    weights : (n,) weights of these blend shapes
    matrix : (4, 4) facial transformation; None if the frame has none
    faces : number of faces in the frame
    """

    error_subject: str
    number: float
    time: float
    unit: float | None
    columns: Intp
    weights: Doubles
    matrix: Doubles | None
    faces: int


def load_mediapipe(path: Path, head: Head, fps: float | None = None) -> Clip:
    """Load results of MediaPipe's face landmarker as a clip for a head.

    The file contains one result per line, a list of results, or an object that contains such a list. Keys may
    be spelled as in any of MediaPipe's APIs, such as face_blendshapes and faceBlendshapes. The blend shapes
    of a result are {name: score}, or a list of names and scores for each face. A facial transformation is a
    matrix (4, 4) as a nested or flat list, or as an object that contains the list; it rotates the bones found
    by `find_rotation_bones`. Times have keys such as "time" [s] and "timestamp_ms". Only the first face is
    used. Frames without a face are interpolated. Notes state all assumptions.

    fps : frame rate if the frames state no times; by default the rate that the file states, or else 30

    Raises DermisError for a file without a face, and for invalid frames; the message names the frame.
    """
    rate, records = _read_frame_records(path)
    columns: dict[str, int] = {}
    frames: list[_CapturedFrame] = []
    record: object = None
    for index, (error_subject, record) in enumerate(records):
        frames.append(_parse_frame(error_subject, index, record, columns))
        check_capture_size(path, len(frames), len(columns))
    lost, several = sum(frame.faces == 0 for frame in frames), sum(frame.faces > 1 for frame in frames)
    if lost == len(frames):
        found = ", ".join(record) if isinstance(record, dict) and record else "nothing"
        actual = f"no frame has any (the last one has {found})"
        refuse(path, f"{_EXPECTED_CONTENT} with blendshapes", actual, _RECORD_ADVICE)
    note_lost_frames(path, lost, len(frames))
    if several:
        notify(f"{path}: {several} of {len(frames)} frames show several faces; the first one is used")
    times, names = _frame_times(path, frames, fps or rate), tuple(columns)
    weights = np.full((len(frames), len(columns)), np.nan)
    for row, frame in zip(weights, frames, strict=True):
        if len(frame.columns):
            row[:] = 0.0
            row[frame.columns] = frame.weights
    weights = weights_as_fractions(path, weights)
    check_weights([frame.error_subject for frame in frames], names, weights)
    angles, unused = _head_angles(path, frames, times, find_rotation_bones(head.control_rig.skeleton))
    samples = CaptureSamples(times, names, fill_gaps(times, weights), angles, unused)
    return capture_clip(path, path.stem, samples, head)


def _read_frame_records(path: Path) -> tuple[float | None, Iterator[tuple[str, object]]]:
    """Return the frame rate that a file states, and the name (for errors) and content of each frame."""
    text = read_text(path, _EXPECTED_CONTENT, MAX_CLIP_BYTES)
    lines = ((f"{path}, line {k}", line) for k, line in enumerate(io.StringIO(text), 1) if line.strip())
    first, second = next(lines, None), next(lines, None)
    if first is None:
        refuse(path, _EXPECTED_CONTENT, "it is empty", "Record it again")
    try:
        document = parse_json(first[1], first[0], _EXPECTED_CONTENT)
    except DermisError:
        if second is None:
            raise
        document = parse_json(text, path, _EXPECTED_CONTENT)  # an object over several lines
    else:
        if second is not None:
            rest = (
                (name, parse_json(line, name, _EXPECTED_CONTENT)) for name, line in chain([second], lines)
            )
            return None, chain([(first[0], document)], rest)
    fields = _fields_by_plain_key(document)
    rate = next(
        (check_frame_rate(f"{path}: {key}", fields[key]) for key in _FRAME_RATE_KEYS if key in fields), None
    )
    return rate, ((f"{path}, frame {k}", record) for k, record in enumerate(_frame_list(document), 1))


def _fields_by_plain_key(json_record: object) -> dict[str, object]:
    return (
        {plain_key(key): value for key, value in json_record.items()} if isinstance(json_record, dict) else {}
    )


def _frame_list(json_document: object) -> list[object]:
    """Return the frames in a JSON document.

    A list contains the frames, unless it is the list of blend shapes of a single frame. An object that has
    blend shapes or a facial transformation is a single frame. In any other object, the longest list contains
    the frames; if there is no list, the object is a single frame.
    """
    if isinstance(json_document, list):
        is_frame = (
            bool(json_document)
            and isinstance(json_document[0], dict)
            and bool(json_document[0].keys() & _SCORE_KEYS)
        )
        return [json_document] if is_frame else json_document
    fields = _fields_by_plain_key(json_document)
    lists = [value for key, value in fields.items() if isinstance(value, list) and key not in _FACE_KEYS]
    lists = [value for value in lists if any(isinstance(item, dict | list) for item in value)]
    is_frame = bool(fields.keys() & {*_SHAPE_KEYS, *_MATRIX_KEYS})
    return [json_document] if is_frame or not lists else max(lists, key=len)


def _parse_frame(
    error_subject: str, frame_index: int, json_record: object, shape_columns: dict[str, int]
) -> _CapturedFrame:
    """Parse the JSON record of a frame.

    If the record has neither blend shapes nor a transformation, the number of faces is 0.

    shape_columns : dictionary from the name of a blend shape to its index among the blend shapes of all
        frames; this function adds missing names
    """
    if isinstance(json_record, list):
        json_record = {"blendshapes": json_record}
    if not isinstance(json_record, dict | None):
        refuse(error_subject, "an object in JSON", f"got {format_value(json_record)}", _LINE_ADVICE)
    fields = _fields_by_plain_key(json_record)
    for value in tuple(fields.values()):  # the record may contain the result as one of its values
        if not fields.keys() & {*_SHAPE_KEYS, *_MATRIX_KEYS}:
            fields = _fields_by_plain_key(value[0] if isinstance(value, list) and value else value) | fields
    shapes, faces = _first_face(next((fields[key] for key in _SHAPE_KEYS if key in fields), None))
    matrix = next((fields[key] for key in _MATRIX_KEYS if key in fields), None)
    transformation = _facial_transformation(error_subject, matrix)
    scores = _shape_scores(error_subject, shapes or {})
    key = next((key for key in SECONDS_PER_TIME_KEY if fields.get(key) is not None), "")
    number = next((fields[key] for key in FRAME_NUMBER_KEYS if key in fields), frame_index)
    listed = fields.get("faces")
    faces = max(faces, len(listed) if isinstance(listed, list) else 0)
    return _CapturedFrame(
        error_subject,
        checked_number(f"{error_subject}: frame", number, -MAX_STATED_TIME, MAX_STATED_TIME),
        checked_number(f"{error_subject}: {key}", fields[key], -MAX_STATED_TIME, MAX_STATED_TIME)
        if key
        else np.nan,
        SECONDS_PER_TIME_KEY.get(key, 1.0),
        np.array([shape_columns.setdefault(name, len(shape_columns)) for name in scores], np.intp),
        np.fromiter(scores.values(), np.float64, len(scores)),
        transformation,
        faces if scores or transformation is not None else 0,
    )


def _first_face(json_faces: object) -> tuple[object, int]:
    """Return the blend shapes of the first face, and the number of faces.

    json_faces : blend shapes as {name: score} or as a list of names and scores, or an object that contains
        this list; for several faces, a list with one of these for each face; None if there is no face
    """
    faces = 1
    while True:
        if isinstance(json_faces, dict) and _wraps_blend_shapes(json_faces):
            json_faces = next(
                item for key, item in json_faces.items() if key in (*_CATEGORY_LIST_KEYS, "value")
            )
        elif (
            isinstance(json_faces, list)
            and json_faces
            and (isinstance(json_faces[0], list) or _wraps_blend_shapes(json_faces[0]))
        ):
            faces, json_faces = max(faces, len(json_faces)), json_faces[0]
        else:
            return json_faces, faces


def _wraps_blend_shapes(json_value: object) -> bool:
    """Return whether a value is an object that contains the list of blend shapes under a known key."""
    return isinstance(json_value, dict) and (
        bool(json_value.keys() & _CATEGORY_LIST_KEYS) or json_value.keys() == {"value"}
    )


def _shape_scores(error_subject: str, json_shapes: object) -> dict[str, float]:
    """Return the score of each blend shape by name.

    json_shapes : {name: score}, or MediaPipe's list of {"categoryName", "score"}
    """
    if isinstance(json_shapes, list):
        categories = [_fields_by_plain_key(item) for item in json_shapes]
        names = [next((item[key] for key in _NAME_KEYS if item.get(key)), None) for item in categories]
        scores = [next((item[key] for key in _SCORE_KEYS if key in item), None) for item in categories]
        if None in names or None in scores:
            refuse(
                error_subject, "a categoryName and a score for each blend shape", "one has none", _LINE_ADVICE
            )
        json_shapes = {str(name): score for name, score in zip(names, scores, strict=True)}
    if not isinstance(json_shapes, dict):
        refuse(
            error_subject,
            "blendshapes by name or as a list",
            f"got {format_value(json_shapes)}",
            _LINE_ADVICE,
        )
    for name, score in json_shapes.items():
        if type(score) not in (int, float):
            refuse(error_subject, "scores as numbers", f"{name} is {format_value(score)}", _LINE_ADVICE)
    return {name: score for name, score in json_shapes.items() if name != NEUTRAL_SHAPE_NAME}


def _facial_transformation(error_subject: str, json_matrix: object) -> Doubles | None:
    """Return the facial transformation (4, 4) of the first face; None if the frame has none.

    The translation is in the last column of the result, whether the file lists the matrix by rows or by
    columns; the place of the translation in the file tells which. If the translation is 0, a flat list inside
    an object or inside another list is taken to be in column-major order, as MediaPipe's APIs return it,
    unless the object states the layout "ROW_MAJOR". Any other matrix without a translation is taken to be in
    row-major order.

    json_matrix : matrix as a nested or flat list, or an object that contains such a list, or a list of
        several matrices or objects, one for each face
    """
    by_columns = False
    while isinstance(json_matrix, dict) or (
        isinstance(json_matrix, list) and json_matrix and not _is_row_or_number(json_matrix[0])
    ):
        by_columns = True
        if isinstance(json_matrix, dict):
            fields = _fields_by_plain_key(json_matrix)
            by_columns = fields.get("layout") != "ROW_MAJOR"
            json_matrix = next(
                (fields[key] for key in _MATRIX_DATA_KEYS if key in fields), [*fields.values()]
            )
        else:
            json_matrix = json_matrix[0]
    if not json_matrix:
        return None
    flat = isinstance(json_matrix, list) and not any(isinstance(row, list) for row in json_matrix)
    shape = (16,) if flat else (4, 4)
    limit = _MAX_MATRIX_VALUE
    matrix = checked_array(f"{error_subject}: matrix", json_matrix, shape, -limit, limit).reshape(4, 4)
    if not abs(np.linalg.det(matrix[:3, :3])) > 1e-12:
        refuse(error_subject, "an invertible matrix", "its determinant is 0", _LINE_ADVICE)
    last_row, last_column = np.abs(matrix[3, :3]).max(), np.abs(matrix[:3, 3]).max()
    no_translation = last_row == last_column == 0
    return matrix.T if last_row > last_column or (no_translation and flat and by_columns) else matrix


def _is_row_or_number(json_value: object) -> bool:
    """Return whether an entry of a list is a row or a number of a matrix, as opposed to a whole matrix."""
    is_nested = isinstance(json_value, list) and (len(json_value) != 4 or isinstance(json_value[0], list))
    return not is_nested and not isinstance(json_value, dict)


def _frame_times(path: Path, frames: Sequence[_CapturedFrame], fps: float | None) -> Doubles:
    """Return the times (k,) of the frames [s], after checking that they do not decrease."""
    times = np.array([frame.time for frame in frames])
    missing = np.isnan(times)
    if missing.all():
        times = np.array([frame.number for frame in frames]) / frame_rate_or_default(
            path, fps, _DEFAULT_FRAME_RATE
        )
    else:
        unstated = np.array([frame.unit is None for frame in frames])
        times *= [frame.unit or 1.0 for frame in frames]
        if unstated.any():
            times[unstated] = to_seconds(path, times[unstated], None)
        if missing.any():
            notify(f"{path}: {missing.sum()} of {len(frames)} frames have no time; it is interpolated")
        times = fill_gaps(np.arange(len(frames), dtype=np.float64), times[:, None])[:, 0]
    for (before, after), frame in zip(pairwise(times.tolist()), frames[1:], strict=True):
        if after < before:
            actual = f"{after:g} s comes after {before:g} s"
            refuse(frame.error_subject, "increasing times", actual, "Sort the lines")
    return times


def _head_angles(
    path: Path, frames: Sequence[_CapturedFrame], times: Doubles, bones: RotationBones
) -> tuple[dict[str, Doubles], tuple[str, ...]]:
    """Return the angles (k, 3) of the head and neck bones by bone name [degrees], and missing bones.

    If the file has head rotations but the head has no bone for them, the second result contains a description
    of the missing bone, for a note to the user. Otherwise it is empty.

    path : file of the capture, for notes
    times : (k,) times of the frames [s]
    bones : bones of the head that perform the rotations
    """
    matrices = [frame.matrix for frame in frames if frame.matrix is not None]
    if not matrices or not bones.head:
        return {}, ("bone for the matrix",) if matrices else ()
    found = np.array([frame.matrix is not None for frame in frames])
    if missing := sum(frame.faces > 0 and frame.matrix is None for frame in frames):
        interpolated = "the turn of the head is interpolated"
        notify(f"{path}: {missing} of {len(frames)} frames have no matrix; {interpolated}")
    angles: dict[str, Doubles] = {}
    for name, rows in head_bone_angles(bones, rotation_quaternions(matrices)).items():
        angles[name] = np.full((len(frames), 3), np.nan)
        angles[name][found] = rows
        angles[name] = fill_gaps(times, angles[name])
    return angles, ()
