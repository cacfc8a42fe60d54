"""Files of one topology, one after the other: their vertices alone."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.reading import BROKEN, is_file, read_file, understood
from dermis.mesh.check import check_arrays
from dermis.mesh.formats import Index, default_unit_mm, obj_model
from dermis.mesh.geometry import compacted
from dermis.mesh.joined import joined
from dermis.mesh.limits import MOST_BYTES
from dermis.mesh.load import Up, check_options, read_model, upright

Floats = NDArray[np.float32]

_PLACE = re.compile(rb"^[ \t]*v[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)[^\n]*\n?", re.MULTILINE)
_NORMAL = re.compile(rb"^[ \t]*vn[ \t][^\n]*\n?", re.MULTILINE)


class Vertices(NamedTuple):
    """A file's vertices, in the order in which its `Mesh` has them.

    positions_mm : (v, 3)
    triangles : (f, 3)
    uv : (v, 2) as in the file
    """

    positions_mm: Floats
    triangles: NDArray[np.int32]
    uv: Floats


class _Pattern(NamedTuple):
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
    _first: Vertices | None = field(default=None, init=False)
    _pattern: _Pattern | None = field(default=None, init=False)

    def read(self, path: Path) -> Vertices:
        """The vertices of a file.

        Raises `DermisError` when it is missing, damaged or not a mesh, or has no uv.
        """
        unit = default_unit_mm(path) if self.unit_mm is None else float(self.unit_mm)
        check_options(path, unit, "auto", self.up)
        if self._pattern is not None and self._first is not None and is_file(path):
            places = _places(read_file(path, "an OBJ file", MOST_BYTES), self._pattern)
            if places is not None:
                moved = self._in_head(unit * places)
                check_arrays(moved, self._first.uv, self._first.triangles, path)
                return self._first._replace(positions_mm=moved)
        vertices = self._parsed(path, unit)
        if self._first is None:
            self._first = vertices
            self._pattern = _pattern(path) if path.suffix.lower() == ".obj" else None
        return vertices

    def _parsed(self, path: Path, unit: float) -> Vertices:
        with np.errstate(all="ignore"), understood(path, "a mesh", *BROKEN):
            part = joined(read_model(path).parts, path)
            place = self._in_head(unit * part.positions)
            assert part.uv is not None
            check_arrays(place, part.uv, part.triangles, path)
        used, corners = compacted(part.triangles)
        return Vertices(place[used], corners.astype(np.int32), part.uv[used].astype(np.float32))

    def _in_head(self, places: NDArray[np.float64]) -> Floats:
        with np.errstate(over="ignore"):  # what is infinite then is refused
            return upright(places, self.up).astype(np.float32)


def _split(data: bytes) -> tuple[list[tuple[bytes, bytes, bytes]], bytes]:
    """Numbers of the `v` lines, and a hash of all others but the normals."""
    others = _NORMAL.sub(b"", _PLACE.sub(b"", data))
    return _PLACE.findall(data), hashlib.sha256(others).digest()


def _pattern(path: Path) -> _Pattern:
    """What an OBJ file has besides its places: it is parsed with the numbers of its lines as places."""
    data = read_file(path, "an OBJ file", MOST_BYTES)
    places, digest = _split(data)
    count = iter(range(len(places)))
    numbered = _PLACE.sub(lambda match: b"v %d 0 0\n" % next(count), data)
    model = obj_model(path, numbered.decode("utf-8", errors="replace"))
    part = joined([part for part in model.parts if len(part.triangles)], path)
    used = np.unique(part.triangles)
    return _Pattern(digest, len(places), part.positions[used, 0].astype(np.int64))


def _places(data: bytes, pattern: _Pattern) -> NDArray[np.float64] | None:
    """(v, 3) places of the vertices in the file's units; None for a file that differs in more than these."""
    rows, digest = _split(data)
    if len(rows) != pattern.lines or digest != pattern.digest:
        return None
    try:
        places = np.array(rows, dtype=bytes).astype(np.float64)[pattern.line]
    except ValueError:  # the parser knows what to say
        return None
    return places if np.isfinite(places).all() else None
