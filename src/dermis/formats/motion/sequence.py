"""Sequences of mesh files with one topology, a file for each frame."""

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
from dermis.base.errors import refuse
from dermis.base.reading import MALFORMED_DATA_ERRORS, is_file, parsing, read_file
from dermis.formats.mesh_checks import check_arrays
from dermis.formats.obj import parse_obj
from dermis.formats.parts import default_unit_mm
from dermis.formats.read import Up, join_parts, read_mesh_file, to_y_up
from dermis.formats.rig_from_file import SPLIT_TOLERANCE_MM
from dermis.formats.size_limits import MAX_FILE_BYTES
from dermis.mesh.clip import Clip
from dermis.mesh.geometry import compacted
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose

SUFFIXES = (".obj", ".ply")
DEFAULT_RATE = 30.0
_FRAME_TOLERANCE = 1e-6
_SIZE_RANGE = (0.33, 3.0)
_NUMBER = re.compile(r"%0?\d*d")
_VERTEX_LINE = re.compile(rb"^[ \t]*v[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)[^\n]*\n?", re.MULTILINE)
_NORMAL_LINE = re.compile(rb"^[ \t]*vn[ \t][^\n]*\n?", re.MULTILINE)


def is_sequence(path: Path) -> bool:
    """Whether a name is a folder, a pattern, or a mesh that could be one frame."""
    return (
        _is_folder(path)
        or bool(_NUMBER.search(path.name))
        or "*" in path.name
        or path.suffix.lower() in SUFFIXES
    )


def frame_files(path: Path) -> list[Path]:
    """The files of a folder, of a pattern as face_%05d.obj or of face_*.obj, in the order of their numbers.

    Raises DermisError when there are none, or of several kinds.
    """
    if _is_folder(path):
        found = [one for one in path.iterdir() if one.suffix.lower() in SUFFIXES]
    elif _NUMBER.search(path.name):
        before, after = _NUMBER.split(path.name, maxsplit=1)
        shape = re.compile(rf"{re.escape(before)}\d+{re.escape(after)}")
        found = [one for one in _listed(path.parent) if shape.fullmatch(one.name)]
    elif "*" in path.name:
        shape = re.compile(fnmatch.translate(path.name))
        found = [one for one in _listed(path.parent) if shape.fullmatch(one.name)]
    else:
        found = [path]
    kinds = sorted({one.suffix.lower() for one in found})
    if not found:
        refuse(path, f"frames as {' or '.join(SUFFIXES)} files", "there are none", "Check the name")
    if len(kinds) > 1 or kinds[0] not in SUFFIXES:
        actual = f"there are {', '.join(kinds)}"
        refuse(path, f"frames of one kind ({' or '.join(SUFFIXES)})", actual, "Name one, as in face_%05d.obj")
    return sorted(found, key=_by_number)


def load_sequence(
    path: Path, head: Head, fps: float | None = None, unit_mm: float | None = None, up: Up = "y"
) -> Clip:
    """The clip of a sequence for a head of the same topology, its vertices in the same order.

    fps : frames a second, 30 when left out
    unit_mm, up : of the files, see `load_head`

    Raises DermisError for files that are no frames of that head; the first, the middle and the last are read
    at once, the others when they are wanted.
    """
    files, rate = frame_files(path), DEFAULT_RATE if fps is None else fps
    frames = _FrameCache(tuple(files), head, FrameReader(unit_mm, up))
    for index in {0, len(files) // 2, len(files) - 1}:
        frames.positions(index)

    def sample(seconds: float) -> Pose:
        index = min(int(seconds * rate + _FRAME_TOLERANCE), len(files) - 1)
        share = min(max(seconds * rate - index, 0.0), 1.0)
        places = frames.positions(index)
        if share > _FRAME_TOLERANCE and index + 1 < len(files):
            places = ((1 - share) * places + share * frames.positions(index + 1)).astype(np.float32)
        return Pose(positions_mm=places)

    name = path.name or str(path)
    return Clip(name, (len(files) - 1) / rate, fps, (), (), (), sample)


@dataclass(eq=False)
class _FrameCache:
    """The points of each file; of the last few files they are kept."""

    files: Sequence[Path]
    head: Head
    reader: FrameReader
    _first: FrameVertices | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        self.positions = lru_cache(maxsize=3)(self._read_positions)

    def _read_positions(self, index: int) -> Floats:
        """(n, 3) the places of the head's points in a frame [mm]."""
        file = self.files[index]
        vertices = self.reader.read(file)
        self._first = self._first or vertices
        self._check_topology(file, vertices)
        control = self.head.control
        point = self.head.mesh.point if control.corner is None else control.corner
        places = np.empty_like(self.head.positions_mm)
        places[point] = vertices.positions_mm
        apart = np.abs(places[point] - vertices.positions_mm).max(axis=1)
        if apart.max() > SPLIT_TOLERANCE_MM:
            actual = f"{np.count_nonzero(apart > SPLIT_TOLERANCE_MM)} part by up to {apart.max():.3g} mm"
            advice = "Load the head from a frame in which nothing touches, such as an open mouth"
            refuse(file, "vertices that are one place in the head to stay together", actual, advice)
        self._check_size(file, places)
        return places

    def _check_topology(self, file: Path, vertices: FrameVertices) -> None:
        assert self._first is not None
        control, mesh = self.head.control, self.head.mesh
        count = len(mesh.point if control.corner is None else control.corner)
        same = np.array_equal(vertices.triangles, self._first.triangles)
        whole = control.corner is not None or np.array_equal(vertices.triangles, mesh.triangles)
        if len(vertices.positions_mm) != count or not whole:
            actual = f"it has {len(vertices.positions_mm)} and {len(vertices.triangles)} triangles"
            expected = f"the head's topology, {count} vertices joined as they are in its file"
            refuse(file, expected, actual, "Load the head from one of the frames")
        if not same or not np.array_equal(vertices.uv, self._first.uv):
            actual = f"its faces or uv differ from those of {self.files[0].name}"
            refuse(file, "frames of one topology", actual, "Export all of them from the same mesh")

    def _check_size(self, file: Path, places: Floats) -> None:
        sizes = [float(np.linalg.norm(np.ptp(one, axis=0))) for one in (places, self.head.positions_mm)]
        if not _SIZE_RANGE[0] <= sizes[0] / sizes[1] <= _SIZE_RANGE[1]:
            actual = f"it is {sizes[0] / sizes[1]:.3g} times as large"
            refuse(file, "a frame about as large as the head", actual, "Set the files' unit (unit_mm)")


def _listed(folder: Path) -> list[Path]:
    return list(folder.iterdir()) if _is_folder(folder) else []


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):  # names that none can have, or that are out of reach
        return False


def _by_number(file: Path) -> tuple[int, str]:
    """Files by the last number in their names."""
    numbers = re.findall(r"\d+", file.stem)
    return int(numbers[-1]) if numbers else -1, file.name


class FrameVertices(NamedTuple):
    """A file's vertices, in the order in which its `Mesh` has them.

    positions_mm : (v, 3)
    triangles : (f, 3)
    uv : (v, 2) as in the file
    """

    positions_mm: Floats
    triangles: Ints
    uv: Floats


class _ObjPattern(NamedTuple):
    """An OBJ file without its places: the hash of its other lines, and which `v` line each vertex is."""

    digest: bytes
    lines: int
    line: Index


@dataclass
class FrameReader:
    """Reads files of one topology.

    An OBJ file that differs from the first one in its places alone is read by these: parsing its faces again
    takes twenty times as long.

    unit_mm : length of the files' unit [mm], None for the format's own
    up : the files' axis that points up
    """

    unit_mm: float | None = None
    up: Up = "y"
    _first: FrameVertices | None = field(default=None, init=False)
    _pattern: _ObjPattern | None = field(default=None, init=False)

    def read(self, path: Path) -> FrameVertices:
        """The vertices of a file.

        Raises `DermisError` when it is missing, damaged or not a mesh, or has no uv.
        """
        unit = default_unit_mm(path) if self.unit_mm is None else float(self.unit_mm)
        if self._pattern is not None and self._first is not None and is_file(path):
            places = _parse_positions(read_file(path, "an OBJ file", MAX_FILE_BYTES), self._pattern)
            if places is not None:
                moved = self._in_head(unit * places)
                check_arrays(moved, self._first.uv, self._first.triangles, path)
                return self._first._replace(positions_mm=moved)
        vertices = self._parsed(path, unit)
        if self._first is None:
            self._first = vertices
            self._pattern = _read_pattern(path) if path.suffix.lower() == ".obj" else None
        return vertices

    def _parsed(self, path: Path, unit: float) -> FrameVertices:
        with np.errstate(all="ignore"), parsing(path, "a mesh", *MALFORMED_DATA_ERRORS):
            part = join_parts(read_mesh_file(path).parts, path)
            place = self._in_head(unit * part.positions)
            assert part.uv is not None
            check_arrays(place, part.uv, part.triangles, path)
        used, corners = compacted(part.triangles)
        return FrameVertices(place[used], corners.astype(np.int32), part.uv[used].astype(np.float32))

    def _in_head(self, places: Doubles) -> Floats:
        with np.errstate(over="ignore"):  # what is infinite then is refused
            return to_y_up(places, self.up).astype(np.float32)


def _split_vertex_lines(data: bytes) -> tuple[list[tuple[bytes, bytes, bytes]], bytes]:
    """Numbers of the `v` lines, and a hash of all others but the normals."""
    others = _NORMAL_LINE.sub(b"", _VERTEX_LINE.sub(b"", data))
    return _VERTEX_LINE.findall(data), hashlib.sha256(others).digest()


def _read_pattern(path: Path) -> _ObjPattern:
    """What an OBJ file has besides its places: it is parsed with the numbers of its lines as places."""
    data = read_file(path, "an OBJ file", MAX_FILE_BYTES)
    places, digest = _split_vertex_lines(data)
    count = iter(range(len(places)))
    numbered = _VERTEX_LINE.sub(lambda match: b"v %d 0 0\n" % next(count), data)
    model = parse_obj(path, numbered.decode("utf-8", errors="replace"))
    part = join_parts([part for part in model.parts if len(part.triangles)], path)
    used = np.unique(part.triangles)
    return _ObjPattern(digest, len(places), part.positions[used, 0].astype(np.int64))


def _parse_positions(data: bytes, pattern: _ObjPattern) -> Doubles | None:
    """(v, 3) places of the vertices in the file's units; None for a file that differs in more than these."""
    rows, digest = _split_vertex_lines(data)
    if len(rows) != pattern.lines or digest != pattern.digest:
        return None
    try:
        places = np.array(rows, dtype=bytes).astype(np.float64)[pattern.line]
    except ValueError:  # the parser knows what to say
        return None
    return places if np.isfinite(places).all() else None
