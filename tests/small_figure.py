"""Standing figure of ellipsoids and other small pieces of skin, as text of OBJ files and as meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import uv_sphere

HEIGHT = 1700.0
CENTRE = np.array([0.0, 1580.0, 0.0])
"""Centre of the figure's head [mm]."""
_PARTS = (  # centre and radii of ellipsoids [mm]
    (CENTRE, (75, 120, 100)),
    ((0, 1440, 0), (50, 120, 50)),
    ((0, 1150, 0), (200, 330, 120)),
    ((0, 1360, 0), (240, 70, 80)),
    ((280, 1050, 0), (40, 330, 40)),
    ((-280, 1050, 0), (40, 330, 40)),
    ((100, 450, 0), (80, 450, 80)),
    ((-100, 450, 0), (80, 450, 80)),
)


def ellipsoids(*parts: tuple[object, object]) -> Mesh:
    """Return a mesh of ellipsoids, each with its centre and radii [mm]."""
    ball = uv_sphere(1.0, 16, 12)
    positions = np.vstack([ball.positions * np.array(radii) + np.array(centre) for centre, radii in parts])
    count = len(ball.positions)
    triangles = np.vstack([ball.triangles + k * count for k in range(len(parts))])
    uv = np.vstack([(ball.uv + np.array([k, 0])) / [len(parts), 1] for k in range(len(parts))])
    return build_mesh(positions, uv, triangles, np.zeros(len(triangles)), ball.materials)


def figure() -> Mesh:
    """Return a figure of 1.7 m, its feet at the origin and its face towards +Z."""
    return ellipsoids(*_PARTS)


def arm() -> Mesh:
    """Return a forearm of 400 mm that hangs obliquely across its bounding box."""
    mesh = ellipsoids(((0, 0, 0), (40, 200, 40)))
    turn = np.array([[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    return build_mesh(mesh.positions @ turn.T, mesh.uv, mesh.triangles, mesh.material, mesh.materials)


def patch(axes: np.ndarray | None = None) -> Mesh:
    """Return a patch of 60 mm that faces +Z.

    axes : (3, 3) its directions to the right, upwards and to the front, if they are not x, y and z
    """
    x, y = (one.ravel() for one in np.meshgrid(np.linspace(-30, 30, 4), np.linspace(-30, 30, 4)))
    positions = np.column_stack([x, y, 0.002 * (900 - x * x)]) @ (np.eye(3) if axes is None else axes)
    corner = np.array([k for k in range(12) if k % 4 < 3])
    triangles = np.vstack(
        [np.column_stack([corner, corner + 1, corner + 5]), np.column_stack([corner, corner + 5, corner + 4])]
    )
    uv = np.column_stack([x / 60 + 0.5, 0.5 - y / 60])
    return build_mesh(positions, uv, triangles, np.zeros(18), uv_sphere(1.0, 8, 4).materials)


def write_obj(path: Path, mesh: Mesh, unit_mm: float = 1.0, extra: str = "usemtl skin") -> Path:
    """Write a mesh as an OBJ file in which a unit has a length [mm]."""
    lines = ["v {:.7g} {:.7g} {:.7g}".format(*one) for one in mesh.positions / unit_mm]
    lines += [f"vt {u:.6g} {1 - v:.6g}" for u, v in mesh.uv]
    lines += [extra, *("f " + " ".join(f"{k}/{k}" for k in face) for face in mesh.triangles + 1)]
    path.write_text("\n".join([*lines, ""]))
    return path
