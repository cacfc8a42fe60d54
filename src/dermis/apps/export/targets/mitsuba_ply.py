"""Triangles as binary PLY files, as Mitsuba reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_FACE = np.dtype([("count", "u1"), ("corner", "<i4", (3,))])


def ply(
    triangles: NDArray[Any], positions: Any, normals: Any = None, uv: Any = None, colour: Any = None
) -> bytes:
    """A file of triangles.

    positions, normals, uv, colour : (v, 3), (v, 3), (v, 2) with v = 0 at the pictures' top, (v, 3) linear
    """
    given = {"x y z": positions, "nx ny nz": normals, "u v": uv, "r g b": colour}
    columns = {names: values for names, values in given.items() if values is not None}
    vertices = np.concatenate([np.asarray(one, "<f4") for one in columns.values()], axis=1)
    lines = [f"property float {name}" for names in columns for name in names.split()]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"element vertex {len(vertices)}",
        *lines,
        f"element face {len(triangles)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    faces = np.empty(len(triangles), _FACE)
    faces["count"], faces["corner"] = 3, triangles
    return "\n".join(header).encode() + b"\n" + vertices.tobytes() + faces.tobytes()
