"""STL files, binary or text: triangles without uv, names or colours."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from dermis.base.arrays import Doubles
from dermis.base.errors import refuse
from dermis.base.file_properties import drawn_property, noted_property, property_without_effect
from dermis.base.reading import read_file
from dermis.formats import size_limits as limits
from dermis.formats.parts import MaterialGroup, MeshFile, MeshPart
from dermis.formats.text_files import parse_numbers

_HEADER_BYTES = 84
_TRIANGLE_DTYPE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_CORNER_LINE = re.compile(rb"^[ \t]*vertex[ \t]+([^\r\n]*)", re.MULTILINE | re.IGNORECASE)

STL_PROPERTIES = (
    drawn_property("corners of triangles", "coincident ones become one vertex"),
    property_without_effect("normals of triangles", "they are computed from the corners"),
    noted_property("attribute bytes", "colours of triangles in some programs"),
    property_without_effect("name or header", "names the part or the program"),
)
"""Properties of STL files."""


def read_stl(path: Path) -> MeshFile:
    """Read a .stl file; corners at the same position become one vertex."""
    data = read_file(path, "an STL file", limits.MAX_FILE_BYTES)
    count = int.from_bytes(data[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")
    is_binary = len(data) >= _HEADER_BYTES and len(data) == _HEADER_BYTES + count * _TRIANGLE_DTYPE.itemsize
    if is_binary or data.lstrip()[:5].lower() != b"solid":
        corners, notes = _binary_corners(path, data, count)
    else:
        corners, notes = _text_corners(path, data), ()
    positions, index = np.unique(corners, axis=0, return_inverse=True)
    part = MeshPart(MaterialGroup(()), positions + 0.0, None, None, index.reshape(-1, 3))
    return MeshFile([part], notes=notes)


def _binary_corners(path: Path, stl_bytes: bytes, triangle_count: int) -> tuple[Doubles, tuple[str, ...]]:
    """Return the corners (3f, 3) of a binary file, and notes for the user.

    triangle_count : number of triangles that the header states
    """
    _check_triangle_count(path, triangle_count)
    if len(stl_bytes) < _HEADER_BYTES + triangle_count * _TRIANGLE_DTYPE.itemsize:
        actual = f"{len(stl_bytes):,} bytes are too few for its {triangle_count:,} triangles"
        refuse(path, "a whole STL file", actual, limits.DAMAGED_ADVICE)
    records = np.frombuffer(stl_bytes, _TRIANGLE_DTYPE, triangle_count, _HEADER_BYTES)
    notes = ("colours of triangles are left out",) if records["attribute"].any() else ()
    return records["corners"].reshape(-1, 3).astype(np.float64), notes


def _text_corners(path: Path, stl_bytes: bytes) -> Doubles:
    """Return the corners (3f, 3) of a text file."""
    lines = _CORNER_LINE.findall(stl_bytes)
    _check_triangle_count(path, len(lines) // 3)
    if len(lines) % 3:
        actual = f"it has {len(lines):,} corners"
        refuse(path, "three corners for each triangle", actual, limits.DAMAGED_ADVICE)
    return parse_numbers(np.frombuffer(b" ".join(lines), np.uint8), 3 * len(lines), np.float64).reshape(-1, 3)


def _check_triangle_count(path: Path, triangle_count: int) -> None:
    limits.check_limit(path, triangle_count, limits.MAX_TRIANGLES, "triangles", limits.DECIMATE_ADVICE)
