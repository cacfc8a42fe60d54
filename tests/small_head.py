"""A head small enough to render quickly: an ellipsoid as the text of an OBJ file."""

from __future__ import annotations

import re
from pathlib import Path

from dermis.mesh.primitives import uv_sphere

HEIGHT_MM = 240.0
SIZE = (160.0, HEIGHT_MM, 190.0)


def obj_text() -> str:
    """Return vertices [mm], uv (v upwards) and faces in the group `skin`, with the face towards +Z."""
    ball = uv_sphere(0.5, 24, 12)
    places = [f"v {x:.6g} {y:.6g} {z:.6g}" for x, y, z in ball.positions * SIZE]
    uv = [f"vt {u:.6g} {1 - v:.6g}" for u, v in ball.uv]
    faces = [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in ball.triangles + 1]
    return "\n".join([*places, *uv, "usemtl skin", *faces, ""])


def without_colour_note(stderr: str) -> str:
    """Return what a command printed without the note that the small head has no colour."""
    return re.sub(r"(?m)^note: .*: its skin has no colour .*\n", "", stderr)


def write_head(path: Path) -> Path:
    path.write_text(obj_text())
    return path
