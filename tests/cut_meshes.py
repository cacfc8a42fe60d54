"""Simple surfaces cut into charts that are rotated, scaled, mirrored or folded, to test seams."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import SKIN_MATERIALS

Floats = NDArray[np.float64]


class Patch(NamedTuple):
    """Grid of cells on a surface and the position of its chart.

    points : (rows, columns, 3) [mm], rows downwards and columns to the right as seen from outside
    flat : (rows, columns, 2) flattened points, x to the right and y down
    """

    points: Floats
    flat: Floats


class ChartPlacement(NamedTuple):
    """Placement of a chart in uv: centre, scale, rotation, and whether it is mirrored."""

    middle: tuple[float, float]
    scale: float
    turn_degrees: float = 0.0
    mirrored: bool = False


def assemble(patches: Sequence[Patch], lays: Sequence[ChartPlacement]) -> Mesh:
    """Return one mesh of all patches; points at the same position are merged."""
    positions, uv, triangles, first = [], [], [], 0
    for patch, lay in zip(patches, lays, strict=True):
        rows, columns = patch.points.shape[:2]
        at = first + np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel()
        triangles += [np.column_stack((a, c, d)), np.column_stack((a, d, b))]
        positions.append(patch.points.reshape(-1, 3))
        uv.append(_laid(patch.flat.reshape(-1, 2), lay))
        first += rows * columns
    places = np.round(np.concatenate(positions), 4)
    corners = np.concatenate(triangles)
    return build_mesh(places, np.concatenate(uv), corners, np.zeros(len(corners)), SKIN_MATERIALS)


def _laid(flat: Floats, lay: ChartPlacement) -> Floats:
    angle = np.radians(lay.turn_degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    side = np.array([-1.0 if lay.mirrored else 1.0, 1.0])
    return np.asarray((flat * side) @ turn.T * lay.scale + lay.middle)


SPHERE_LAYS = (
    ChartPlacement((0.17, 0.2), 0.10),
    ChartPlacement((0.5, 0.2), 0.09, 90.0),
    ChartPlacement((0.83, 0.2), 0.11, -35.0),
    ChartPlacement((0.17, 0.7), 0.08, 180.0, mirrored=True),
    ChartPlacement((0.5, 0.7), 0.10, 20.0),
    ChartPlacement((0.83, 0.7), 0.095, 0.0, mirrored=True),
)


def cut_sphere(radius_mm: float, cells: int, lays: Sequence[ChartPlacement] = SPHERE_LAYS) -> Mesh:
    """Return a sphere about the origin as six charts of `cells` x `cells`, one per face of a cube."""
    along = np.tan(np.linspace(-np.pi / 4, np.pi / 4, cells + 1))
    x, y = np.meshgrid(along, along)
    front = np.stack((x, -y, np.ones_like(x)), axis=-1)
    flat = np.stack(np.meshgrid(*2 * [np.linspace(-1, 1, cells + 1)]), axis=-1)
    patches = []
    for k in range(6):
        face = front if k < 4 else np.stack((x, np.ones_like(x), y), axis=-1) * [1, 1 if k == 4 else -1, 1]
        if k == 5:
            face = face * [1, 1, -1]
        turn = np.pi / 2 * (k if k < 4 else 0)
        spin = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
        face = face @ spin.T
        patches.append(Patch(radius_mm * face / np.linalg.norm(face, axis=-1, keepdims=True), flat))
    return assemble(patches, lays)


CYLINDER_LAYS = (
    ChartPlacement((0.2, 0.5), 0.0045),
    ChartPlacement((0.53, 0.5), 0.0035, 90.0),
    ChartPlacement((0.84, 0.5), 0.004, 0.0, mirrored=True),
)


def cut_cylinder(
    radius_mm: float, height_mm: float, cells: int, lays: Sequence[ChartPlacement] = CYLINDER_LAYS
) -> Mesh:
    """Return an open cylinder around the Y axis with one unstretched chart per placement."""
    patches = []
    share = 2 * np.pi / len(lays)
    for k in range(len(lays)):
        angle, height = np.meshgrid(
            share * (k + np.linspace(0, 1, cells + 1)), height_mm * np.linspace(0.5, -0.5, cells + 1)
        )
        angle = np.where(
            np.isclose(angle, 2 * np.pi), 0.0, angle
        )  # exactly the same numbers, so that it welds
        points = np.stack((radius_mm * np.sin(angle), height, radius_mm * np.cos(angle)), axis=-1)
        across, down = np.meshgrid(
            radius_mm * share * np.linspace(-0.5, 0.5, cells + 1),
            height_mm * np.linspace(-0.5, 0.5, cells + 1),
        )
        patches.append(Patch(points, np.stack((across, down), axis=-1)))
    return assemble(patches, lays)


def cut_cone(radius_mm: float, gap_degrees: float, rings: int = 16, segments: int = 64) -> Mesh:
    """Return a cone cut along one line and flattened to a disc with a slit that narrows towards the apex."""
    whole = 2 * np.pi - np.radians(gap_degrees)
    away, angle = np.meshgrid(
        radius_mm * np.linspace(0, 1, rings + 1), whole * np.linspace(0, 1, segments + 1)
    )
    slope = whole / (2 * np.pi)
    around = np.where(np.isclose(angle, whole), 0.0, angle) / slope
    points = np.stack(
        (away * slope * np.sin(around), away * slope * np.cos(around), -away * np.sqrt(1 - slope**2)), axis=-1
    )
    start = angle + np.radians(gap_degrees) / 2
    flat = np.stack((away * np.sin(start), -away * np.cos(start)), axis=-1)
    # rows run around, columns outwards: a triangle at the apex has no area and is left out
    mesh = assemble([Patch(points[::-1], flat[::-1])], [ChartPlacement((0.5, 0.5), 0.45 / radius_mm)])
    p = mesh.positions[mesh.triangles]
    sound = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) > 1e-9
    return build_mesh(mesh.positions, mesh.uv, mesh.triangles[sound], mesh.material[sound], SKIN_MATERIALS)


def folded_sheet(side_mm: float, cells: int) -> Mesh:
    """Return a flat square whose left half has the mirrored uv of the right half."""
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, 2 * cells + 1), np.linspace(-0.5, 0.5, 2 * cells + 1))
    points = side_mm * np.stack((x, -y, 0 * x), axis=-1)
    flat = np.stack((np.abs(x), y), axis=-1)
    return assemble([Patch(points, flat)], [ChartPlacement((0.2, 0.5), 0.9)])
