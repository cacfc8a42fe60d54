"""Sequences of mesh files with the same topology, one file per frame."""

from __future__ import annotations

import fnmatch
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints
from dermis.base.errors import notify, refuse
from dermis.base.reading import MALFORMED_DATA_ERRORS, is_file, refuse_parse_errors
from dermis.formats.axes import DEFAULT_AXES, Axes, Axis, Front, to_y_up
from dermis.formats.mesh_checks import check_arrays
from dermis.formats.obj import parse_obj, read_obj_text
from dermis.formats.parts import default_unit_mm
from dermis.formats.read import join_parts, read_mesh_file
from dermis.formats.rig_from_file import COINCIDENCE_TOLERANCE_MM
from dermis.formats.units import COMMON_UNITS_MM
from dermis.mesh.clip import Clip
from dermis.mesh.file_vertices import FileVertices
from dermis.mesh.geometry import compact_vertices, triangle_keys
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose

FRAME_SUFFIXES = (".obj", ".ply")
DEFAULT_FRAME_RATE = 30.0
_FRAME_NUMBER_TOLERANCE = 1e-6
_FRAME_TO_HEAD_SIZE_RANGE = (0.33, 3.0)
_FRAME_NUMBER_FIELD = re.compile(r"%0?\d*d")
_VERTEX_LINE = re.compile(rb"^[ \t]*v[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)[^\n]*\n?", re.MULTILINE)
_NORMAL_LINE = re.compile(rb"^[ \t]*vn[ \t][^\n]*\n?", re.MULTILINE)


def is_sequence(path: Path) -> bool:
    """Return whether a path may be a mesh sequence: a folder, a pattern (face_%05d.obj), or a mesh file."""
    is_pattern = bool(_FRAME_NUMBER_FIELD.search(path.name)) or "*" in path.name
    return is_pattern or _is_folder(path) or path.suffix.lower() in FRAME_SUFFIXES


def frame_files(path: Path) -> list[Path]:
    """Return the mesh files in a folder, or the mesh files whose names match a pattern.

    The files are sorted by the last number in their names.

    path : folder, or pattern such as face_%05d.obj or face_*.obj

    Raises DermisError when there are no files, or files of several formats.
    """
    if _is_folder(path):
        files = [one for one in path.iterdir() if one.suffix.lower() in FRAME_SUFFIXES]
    elif _FRAME_NUMBER_FIELD.search(path.name):
        before, after = _FRAME_NUMBER_FIELD.split(path.name, maxsplit=1)
        shape = re.compile(rf"{re.escape(before)}\d+{re.escape(after)}")
        files = [one for one in _mesh_files_in_folder(path.parent) if shape.fullmatch(one.name)]
    elif "*" in path.name:
        shape = re.compile(fnmatch.translate(path.name))
        files = [one for one in _mesh_files_in_folder(path.parent) if shape.fullmatch(one.name)]
    else:
        files = [path]
    kinds = sorted({file.suffix.lower() for file in files})
    if not files:
        refuse(path, f"frames as {' or '.join(FRAME_SUFFIXES)} files", "there are none", "Check the name")
    if len(kinds) > 1 or kinds[0] not in FRAME_SUFFIXES:
        actual = f"there are {', '.join(kinds)}"
        refuse(
            path,
            f"frames of one kind ({' or '.join(FRAME_SUFFIXES)})",
            actual,
            "Use a pattern for one of them, such as face_%05d.obj",
        )
    return sorted(files, key=_frame_sort_key)


def load_sequence(
    path: Path,
    head: Head,
    fps: float | None = None,
    unit_mm: float | None = None,
    up: Axis | None = None,
    front: Front = "auto",
) -> Clip:
    """Load a sequence of mesh files, one per frame, as a clip for a head with the same topology.

    The vertices must have the same order in the files as in the head's file.

    fps : frame rate, by default 30
    unit_mm : unit of the files [mm]; by default a unit in which the first mesh is about as large as the head
    up : axis of the files that points upwards; by default the up axis of the head's file
    front : axis of the files along which the face looks; by default the front of the head's file

    The first, the middle and the last file are read immediately, all other files on demand.

    Raises DermisError for files that do not have the topology of the head.
    """
    files, rate = frame_files(path), DEFAULT_FRAME_RATE if fps is None else fps
    axes, source = Axes(up, front), head.file_vertices
    to_head = to_y_up(np.eye(3), axes).T if source is None or axes != DEFAULT_AXES else source.to_head
    reader = FrameReader(unit_mm, to_head)
    if unit_mm is None and (unit := _unit_matching_head_size(files[0], head, reader)) != default_unit_mm(
        files[0]
    ):
        reader = FrameReader(unit, to_head)
    frames = _FrameCache(tuple(files), head, reader)
    for index in {0, len(files) // 2, len(files) - 1}:
        frames.positions(index)

    def sample(seconds: float) -> Pose:
        index = min(int(seconds * rate + _FRAME_NUMBER_TOLERANCE), len(files) - 1)
        fraction = min(max(seconds * rate - index, 0.0), 1.0)
        positions = frames.positions(index)
        if fraction > _FRAME_NUMBER_TOLERANCE and index + 1 < len(files):
            following = frames.positions(index + 1)
            positions = ((1 - fraction) * positions + fraction * following).astype(np.float32)
        return Pose(positions_mm=positions)

    name = path.name or str(path)
    return Clip(name, (len(files) - 1) / rate, fps, (), (), (), sample)


@dataclass(eq=False)
class _FrameCache:
    """Positions of the points of a head in each frame of a sequence, read on demand, with a small cache."""

    files: Sequence[Path]
    head: Head
    reader: FrameReader
    _first: FrameVertices | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        """Create `positions`, the cached version of `_read_positions`."""
        self.positions = lru_cache(maxsize=3)(self._read_positions)
        mesh, vertex = self.head.mesh, np.arange(len(self.head.mesh.point), dtype=np.int32)
        own = FileVertices(len(vertex), vertex, mesh.point, mesh.triangles, np.eye(3))
        self._source = self.head.file_vertices or own

    def _read_positions(self, frame_index: int) -> Floats:
        """Return the positions of the head's control points in a frame, (n, 3) [mm]."""
        file = self.files[frame_index]
        vertices = self.reader.read(file)
        self._first = self._first or vertices
        self._check_topology(file, vertices)
        positions, point = np.empty_like(self.head.positions_mm), self._source.point
        at_points = vertices.positions_mm[self._source.vertex]
        positions[point] = at_points
        difference = np.abs(positions[point] - at_points).max(axis=1)
        if difference.max() > COINCIDENCE_TOLERANCE_MM:
            count = np.count_nonzero(difference > COINCIDENCE_TOLERANCE_MM)
            actual = f"{count} separate by up to {difference.max():.3g} mm"
            advice = "Load the head from a frame in which nothing touches, such as an open mouth"
            refuse(file, "vertices that coincide in the head to stay together", actual, advice)
        self._check_size(file, positions)
        return positions

    def _check_topology(self, mesh_file: Path, vertices: FrameVertices) -> None:
        assert self._first is not None
        source, count = self._source, self._source.count
        same_triangles = np.array_equal(vertices.triangles, self._first.triangles)
        # the head lacks the triangles that were left out when it was read
        of_head = triangle_keys(source.vertex[source.triangles], count)
        matches_head = np.isin(of_head, triangle_keys(vertices.triangles, count)).all()
        if len(vertices.positions_mm) != count or not matches_head:
            actual = f"it has {len(vertices.positions_mm)} and {len(vertices.triangles)} triangles"
            expected = f"the topology of the head, {count} vertices connected as in its file"
            refuse(mesh_file, expected, actual, "Load the head from one of the frames")
        if not same_triangles or not np.array_equal(vertices.uv, self._first.uv):
            actual = f"its faces or uv differ from those of {self.files[0].name}"
            refuse(mesh_file, "frames of one topology", actual, "Export all of them from the same mesh")

    def _check_size(self, mesh_file: Path, positions: Floats) -> None:
        sizes = [float(np.linalg.norm(np.ptp(one, axis=0))) for one in (positions, self.head.positions_mm)]
        if not _FRAME_TO_HEAD_SIZE_RANGE[0] <= sizes[0] / sizes[1] <= _FRAME_TO_HEAD_SIZE_RANGE[1]:
            actual = f"it is {sizes[0] / sizes[1]:.3g} times as large"
            refuse(
                mesh_file, "a frame of about the size of the head", actual, "Set the files' unit (unit_mm)"
            )


def _unit_matching_head_size(mesh_file: Path, head: Head, reader: FrameReader) -> float:
    """Return the unit with which the mesh in a file is about as large as the head [mm].

    The unit of the file's format is preferred; if another unit is chosen, a note states it.
    """
    read_mm, head_mm = (
        np.linalg.norm(np.ptp(one, axis=0))
        for one in (reader.read(mesh_file).positions_mm, head.positions_mm)
    )
    default = default_unit_mm(mesh_file)
    low, high = _FRAME_TO_HEAD_SIZE_RANGE
    if low <= read_mm / head_mm <= high:
        return default
    unit = min(COMMON_UNITS_MM, key=lambda one: abs(np.log(one / default * read_mm / head_mm)))
    notify(f"{mesh_file}: its unit is not stated; 1 unit = {unit:g} mm makes it as large as the head")
    return unit


def _mesh_files_in_folder(sequence_folder: Path) -> list[Path]:
    return list(sequence_folder.iterdir()) if _is_folder(sequence_folder) else []


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):  # invalid or inaccessible names
        return False


def _frame_sort_key(mesh_file: Path) -> tuple[int, str]:
    """Return the sort key of a file: the last number in its name, then the whole name."""
    numbers = re.findall(r"\d+", mesh_file.stem)
    return int(numbers[-1]) if numbers else -1, mesh_file.name


class FrameVertices(NamedTuple):
    """Vertices of one mesh file that its triangles use.

    positions_mm : (v, 3) vertex positions [mm]
    triangles : (f, 3) vertex indices
    uv : (v, 2) uv with the v direction of the file
    """

    positions_mm: Floats
    triangles: Ints
    uv: Floats


class _ObjFingerprint(NamedTuple):
    """Fingerprint of an OBJ file: equal for files that differ only in positions and normals.

    It also says which `v` line contains the position of each vertex, so that the positions of another file
    with this fingerprint can be read without parsing the rest of the file.

    digest : hash of all lines except `v` and `vn`
    line_count : number of `v` lines
    line_of_vertex : (v,) number of the `v` line of each vertex, counted from 0 among the `v` lines
    """

    digest: bytes
    line_count: int
    line_of_vertex: Index


@dataclass
class FrameReader:
    """Reader of the mesh files of a sequence, which have the same topology.

    OBJ files that differ from the first file only in positions and normals are read 20 times as fast as
    other files, because only their positions are parsed.

    unit_mm : length of the files' unit [mm]; None for the default of the format
    to_head : (3, 3) rotation from the axes of the files to the axes of the head
    """

    unit_mm: float | None = None
    to_head: Doubles = field(default_factory=lambda: np.eye(3))
    _first: FrameVertices | None = field(default=None, init=False)
    _first_fingerprint: _ObjFingerprint | None = field(default=None, init=False)

    def read(self, path: Path) -> FrameVertices:
        """Return the vertices of a mesh file.

        Raises `DermisError` when the file is missing, damaged or not a mesh, or has no uv.
        """
        unit = default_unit_mm(path) if self.unit_mm is None else float(self.unit_mm)
        if self._first_fingerprint is not None and self._first is not None and is_file(path):
            positions = _parse_positions(read_obj_text(path).encode(), self._first_fingerprint)
            if positions is not None:
                positions_mm = self._to_head_axes(unit * positions)
                check_arrays(positions_mm, self._first.uv, self._first.triangles, path)
                return self._first._replace(positions_mm=positions_mm)
        vertices = self._parse_vertices(path, unit)
        if self._first is None:
            self._first = vertices
            self._first_fingerprint = (
                self._read_fingerprint(path, unit) if path.suffix.lower() == ".obj" else None
            )
        return vertices

    def _parse_vertices(self, path: Path, unit_mm: float) -> FrameVertices:
        with np.errstate(all="ignore"), refuse_parse_errors(path, "a mesh", *MALFORMED_DATA_ERRORS):
            part = join_parts(read_mesh_file(path).parts, path)
            positions = self._to_head_axes(unit_mm * part.positions)
            assert part.uv is not None
            check_arrays(positions, part.uv, part.triangles, path)
        used, corners = compact_vertices(part.triangles)
        return FrameVertices(positions[used], corners.astype(np.int32), part.uv[used].astype(np.float32))

    def _read_fingerprint(self, path: Path, unit_mm: float) -> _ObjFingerprint | None:
        """Return the fingerprint of the first OBJ file of a sequence.

        Returns None if fast reading with the fingerprint gives other positions than full parsing.
        """
        assert self._first is not None
        data = read_obj_text(path).encode()
        fingerprint = _obj_fingerprint(path, data)
        positions = _parse_positions(data, fingerprint)
        same = positions is not None and np.array_equal(
            self._to_head_axes(unit_mm * positions), self._first.positions_mm
        )
        return fingerprint if same else None

    def _to_head_axes(self, positions: Doubles) -> Floats:
        with np.errstate(over="ignore"):  # infinite positions are refused later
            return (positions @ self.to_head.T).astype(np.float32)


def _split_vertex_lines(obj_bytes: bytes) -> tuple[list[tuple[bytes, bytes, bytes]], bytes]:
    """Return the coordinates of the `v` lines as text, and a hash of all other lines except `vn`."""
    others = _NORMAL_LINE.sub(b"", _VERTEX_LINE.sub(b"", obj_bytes))
    return _VERTEX_LINE.findall(obj_bytes), hashlib.sha256(others).digest()


def _obj_fingerprint(path: Path, obj_bytes: bytes) -> _ObjFingerprint:
    """Return the fingerprint of an OBJ file.

    The parser does not tell from which `v` line it made each vertex. Therefore, it gets a copy of the file in
    which the x coordinate in each `v` line is the number of that line. The parsed x coordinate of a vertex is
    then its `_ObjFingerprint.line_of_vertex`.

    path : path of the file, for errors
    obj_bytes : text of the file in UTF-8
    """
    positions, digest = _split_vertex_lines(obj_bytes)
    count = iter(range(len(positions)))
    numbered = _VERTEX_LINE.sub(lambda match: b"v %d 0 0\n" % next(count), obj_bytes)
    model = parse_obj(path, numbered.decode())
    part = join_parts([part for part in model.parts if len(part.triangles)], path)
    used = np.unique(part.triangles)
    return _ObjFingerprint(digest, len(positions), part.positions[used, 0].astype(np.int64))


def _parse_positions(obj_bytes: bytes, fingerprint: _ObjFingerprint) -> Doubles | None:
    """Return the vertex positions (v, 3) of an OBJ file in file units.

    Returns None if the file has another fingerprint, or positions that are not finite numbers.

    obj_bytes : bytes of the file
    fingerprint : fingerprint of the first file of the sequence, which all files should have
    """
    rows, digest = _split_vertex_lines(obj_bytes)
    if len(rows) != fingerprint.line_count or digest != fingerprint.digest:
        return None
    try:
        positions = np.array(rows, dtype=bytes).astype(np.float64)[fingerprint.line_of_vertex]
    except ValueError:  # the parser raises a better error
        return None
    return positions if np.isfinite(positions).all() else None
