"""Density of scalp hair and beard over the skin, and hair roots with that density."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.base.arrays import Doubles, Floats
from dermis.base.tables import read_rows
from dermis.human.curves import smoothstep
from dermis.human.hair.root_finder import Index, RootFinder
from dermis.human.hair.root_sampling import CANDIDATES_PER_SAMPLE, progressive_samples, spread_thresholds
from dermis.human.hair.styles import BeardArea
from dermis.human.skin.face import HAIRLINE_STEP_DEGREES, ZONE_AMOUNTS, hairline_heights, zone_table
from dermis.human.skin.surface import BORDER_FIELDS, average_surface
from dermis.mesh.geometry import cross_columns, dot_columns
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import Roots, interpolate_quads, quad_corners

HEAD_AXIS_Z = -72.0
"""z coordinate of the vertical axis of the head; angles along the hairline are about this axis [mm]."""
_MIN_RELATIVE_DENSITY = 0.02  # below which no hair grows, so that no hair is alone beyond an edge
_SCALP_BOTTOM_Y = -80.0  # lower end of the hair of the head [mm]
_HAIRLINE_FADE_MM = (-3.0, 11.0)  # heights above the hairline between which density rises from 0 to 1
_LIP_FADE_MM = (0.8, 3.0)  # distances from the lips between which the density of the beard rises
_BEARD_FADE = (0.2, 0.6)  # zone amounts between which the density of the beard rises
_HAIRLINE_WAVES = np.array([[0.37, 0.0, 0.23], [0.81, -0.5, 0.0]])  # wave vectors of the hairline [rad/mm]

_SCALP_MARGIN_MM = 25.0  # distance below the hairline down to which quads may have hair
_EAR_TOP_MM = (73.0, 3.0, -78.0)  # where the left ear meets the scalp, on the mean person
_BROW_MARGIN_MM = 8.0  # distance from quads of the brows within which their hairs may touch the skin
_MIN_BEARD_AMOUNT = 0.02  # zone amount above which quads may have a beard


class HairDensity(NamedTuple):
    """Relative density of scalp hair or beard over the skin.

    relative_density : function that returns the relative density (n,), 0 to 1, at n skin points; its
        argument is an array (n, 4) with the columns of `average_control_points`
    candidates : (p,) mask of the control points near which hair may grow; a quad with no corner among
        them gets no hair roots
    """

    relative_density: Callable[[Doubles], Doubles]
    candidates: NDArray[np.bool_]


def sample_roots(
    mesh: Mesh, density: HairDensity, max_roots_per_cm2: float, rng: np.random.Generator
) -> Roots:
    """Return hair roots as progressive blue noise, whose number per area follows `density`.

    The roots of each prefix are spread evenly, too, so that a prefix can represent all roots. No hair grows
    on the ears, on the lips or in the mouth.

    mesh : control mesh of the person
    density : relative density over the skin
    max_roots_per_cm2 : number of roots per area where the relative density is 1 [1/cm2]
    """
    quad = _hairy_quads(mesh)
    corner_points = quad_corners(mesh, quad)
    candidates_per_cm2 = CANDIDATES_PER_SAMPLE * max_roots_per_cm2
    counts = np.floor(candidates_per_cm2 * quad_areas_cm2(mesh, quad) + rng.random(len(quad))).astype(
        np.int64
    )
    index = np.repeat(np.arange(len(quad)), counts)
    position = rng.random((len(index), 2))
    near = np.asarray(density.candidates[corner_points].any(axis=1)).take(index)
    index, position = index[near], position[near]
    corners = corner_points.T.take(index, axis=1)
    values = average_control_points().T.take(corners, axis=1)
    relative_density = density.relative_density(interpolate_quads(position, values).T)
    some = np.flatnonzero(relative_density > _MIN_RELATIVE_DENSITY)
    some = some[rng.permutation(len(some))]
    points_mm = interpolate_quads(position[some], mesh.points_mm.T.take(corners[:, some], axis=1)).T
    count = round(len(some) / CANDIDATES_PER_SAMPLE)
    accepted = progressive_samples(points_mm, 100.0 * len(some) / candidates_per_cm2, count)
    thinned = spread_thresholds(points_mm[accepted]) < relative_density[some[accepted]]
    root = some[accepted[thinned]]
    return Roots(quad[index[root]].astype(np.int32), position[root].astype(np.float32))


def height_above_hairline(points: Doubles, recession: float = 0.0) -> Doubles:
    """Return the height (n,) of points on the average person above the hairline, negative below it [mm].

    points : (n, 3 or more) positions on the average person [mm]
    recession : recession of the hairline, 0 to 1, see `SkinLook`
    """
    edge = hairline_heights(recession)
    angles = HAIRLINE_STEP_DEGREES * np.arange(len(edge))
    return np.asarray(points[:, 1] - np.interp(hairline_angle(points), angles, edge))


def hairline_angle(points: Doubles) -> Doubles:
    """Return the angles (n,) at which points lie around the head's axis: 0 in front, 180 behind [degrees]."""
    return np.degrees(np.arctan2(np.abs(points[:, 0]), points[:, 2] - HEAD_AXIS_Z))


def hairline_waves(points: Doubles) -> Doubles:
    """Return small displacements (n,) of the hairline, which make it irregular [mm]."""
    return np.asarray(sum(np.sin(points[:, :3] @ wave) for wave in _HAIRLINE_WAVES))


def recession_effect(amount_name: str, recession: float, points: Doubles) -> Doubles:
    """Return by how much (n,) a receding hairline changes an amount, such as hair density, at given points.

    amount_name : one of `ZONE_AMOUNTS`, such as "hair"
    recession : recession of the hairline, 0 to 1, see `SkinLook`
    points : (n, 3 or more) positions on the average person [mm]
    """
    column = _amount_column(amount_name)
    receding = zone_table(recession)[:, column] != zone_table()[:, column]
    return _sum_zones(amount_name, zone_table(recession)[receding], points)


def scalp_density(recession: float, margin_mm: float = 0.0) -> HairDensity:
    """Return the relative density of scalp hair, which fades at the hairline and is thin on a receding crown.

    recession : recession of hairline and crown, 0 to 1, see `SkinLook`
    margin_mm : distance by which the hairline is lowered, for roots of baby hairs and widow's peaks; it
        decreases to 0 above the ears, which these hairs would enter [mm]
    """
    column = _amount_column("hair")
    receding = zone_table(recession)[:, column] != zone_table()[:, column]

    def relative_density(points: Doubles) -> Doubles:
        above = height_above_hairline(points, recession) + margin_mm * _distance_weight_from_ears(points)
        low, high = _HAIRLINE_FADE_MM
        margin = len(_HAIRLINE_WAVES)
        near = np.flatnonzero((above > low - margin) & (above < high + margin))
        above[near] += hairline_waves(points[near])
        fraction = smoothstep(low, high, above) * (points[:, 1] > _SCALP_BOTTOM_Y)
        thinned = _sum_zones("hair", zone_table(recession)[receding], points)
        return np.asarray(fraction * np.clip(1.0 + thinned, 0.0, 1.0))

    return HairDensity(relative_density, _scalp_point_mask())


def _distance_weight_from_ears(points: Doubles) -> Doubles:
    """Return weights (n,) of points, from 0 where an ear begins at its top to 1 at a distance of 25 mm."""
    offsets = np.column_stack([np.abs(points[:, 0]), points[:, 1:3]]) - _EAR_TOP_MM
    return smoothstep(10.0, 25.0, np.linalg.norm(offsets, axis=1))


def beard_density(area: BeardArea = "all") -> HairDensity:
    """Return the relative density of the beard, which ends at the lips.

    area : part of the face that the beard covers, see `Style`
    """
    return HairDensity(lambda points: _beard_amount(points) * _BEARD_AREAS[area](points), _beard_point_mask())


def _moustache_weight(points: Doubles) -> Doubles:
    """Return weights (n,) of points, from 1 where a moustache grows to 0 elsewhere."""
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    return smoothstep(34.0, 27.0, x) * smoothstep(-71.0, -66.0, y - 0.12 * x) * (z > 0.0)


def _goatee_weight(points: Doubles) -> Doubles:
    """Return weights (n,) of points, from 1 where a moustache or a goatee grows to 0 elsewhere."""
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    chin = smoothstep(33.0, 26.0, x) * smoothstep(-116.0, -108.0, y) * (z > 0.0)
    return np.asarray(np.maximum(chin * (y < -60.0), _moustache_weight(points)))


_BEARD_AREAS: dict[BeardArea, Callable[[Doubles], Doubles]] = {
    "all": lambda points: np.ones(len(points)),
    "lip": _moustache_weight,
    "chin": _goatee_weight,
}


@cache
def _scalp_point_mask() -> NDArray[np.bool_]:
    return height_above_hairline(average_control_points()) > -_SCALP_MARGIN_MM


@cache
def _beard_point_mask() -> NDArray[np.bool_]:
    return _sum_zones("beard", zone_table(), average_control_points()) > _MIN_BEARD_AMOUNT


def _beard_amount(points: Doubles) -> Doubles:
    lip_fade = smoothstep(*_LIP_FADE_MM, -points[:, 3])
    return np.asarray(smoothstep(*_BEARD_FADE, _sum_zones("beard", zone_table(), points)) * lip_fade)


def quad_areas_cm2(control_mesh: Mesh, quad_index: Index) -> Doubles:
    """Return the areas (n,) of quads of a control mesh [cm2].

    quad_index : (n,) indices of the quads
    """
    corner_points = control_mesh.points_mm.T.take(quad_corners(control_mesh, quad_index).T, axis=1)
    a, b, c, d = corner_points.swapaxes(0, 1)
    across = cross_columns(c - a, d - b)
    return np.asarray(np.sqrt(dot_columns(across, across)) / 200.0)


def _sum_zones(amount_name: str, zone_rows: Floats, points: Doubles) -> Doubles:
    """Return an amount (n,), such as hair density, at points, as a sum of Gaussians, one for each face zone.

    amount_name : one of `ZONE_AMOUNTS`, such as "hair"
    zone_rows : (k, 24) parameters of the zones, from `zone_table`
    points : (n, 3 or more) positions on the average person [mm]
    """
    column, total = _amount_column(amount_name), np.zeros(len(points))
    mirrored = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    for zone in zone_rows[zone_rows[:, column] != 0.0].astype(np.float64):
        distance2 = sum(((mirrored[c] - zone[c]) * zone[4 + c]) ** 2 for c in range(3))
        total += zone[column] * np.exp(-distance2)
    return total


@cache
def skin_vertices_near_brows(root_finder: RootFinder) -> Index:
    """Return the indices of the vertices of the subdivided mesh that brow hairs may touch.

    root_finder : root finder of the mean person, with the subdivided mesh
    """
    from scipy.spatial import cKDTree

    brow_points = quad_corners(root_finder.mesh, root_finder.brow_grid_roots.quad)
    tree, positions = (
        cKDTree(root_finder.points_mm[np.unique(brow_points)]),
        root_finder.subdivided_mesh.positions,
    )
    return np.flatnonzero(tree.query(positions, distance_upper_bound=_BROW_MARGIN_MM)[0] < _BROW_MARGIN_MM)


def _amount_column(amount_name: str) -> int:
    return 8 + ZONE_AMOUNTS.index(amount_name)


@cache
def average_control_points() -> Doubles:
    """Return the control points (p, 4) of the average person.

    The columns are x, y, z and the signed distance to the border of the lips, positive on the lips [mm].
    """
    points_mm, distances = average_surface()
    lips = distances[:, BORDER_FIELDS.index("lips")]
    return np.asfortranarray(np.column_stack([points_mm, lips]), np.float64)


@cache
def _hairless_quads() -> Index:
    """Return the indices of quads on which no hair grows: ears, lips and the inside of the mouth."""
    rows = read_rows("dermis.human.regions", "parts")
    return np.concatenate([np.arange(int(row["first"]), int(row["last"]) + 1) for row in rows])


def _hairy_quads(control_mesh: Mesh) -> Index:
    is_skin = np.array([material.kind == "skin" for material in control_mesh.materials])
    skin = is_skin[control_mesh.material[control_mesh.quads[:, 0]]]
    skin[_hairless_quads()] = False
    return np.flatnonzero(skin)
