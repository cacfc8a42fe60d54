"""STL files of a ball of 240 mm."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.mesh.primitives import uv_sphere

BALL = uv_sphere(120, 12, 8)
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: Path, *, text: bool = False, attribute: int = 0, header: bytes = b"") -> Path:
    """Write the ball; `attribute` is that of each triangle of a binary file."""
    corners = BALL.positions[BALL.triangles]
    if text:
        rows = ["\n".join("  vertex {:.8e} {:.8e} {:.8e}".format(*one) for one in three) for three in corners]
        facets = [f"facet normal 0 0 0\n outer loop\n{row}\n endloop\nendfacet" for row in rows]
        path.write_text("\n".join(["solid ball", *facets, "endsolid ball", ""]))
        return path
    records = np.zeros(len(corners), _RECORD)
    records["corners"], records["attribute"] = corners, attribute
    path.write_bytes(header.ljust(80, b"\0") + len(corners).to_bytes(4, "little") + records.tobytes())
    return path
