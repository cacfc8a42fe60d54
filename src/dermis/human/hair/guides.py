"""Guide hairs: curves that are combed over the mean person, bent by gravity, and cut."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles
from dermis.human.curves import smoothstep
from dermis.human.hair.root_finder import RootFinder
from dermis.human.hair.skin_surface import SkinSurface, tangent_component
from dermis.human.hair.styles import Style
from dermis.mesh.groom import ANCHORS_PER_GUIDE_KNOT, KNOTS_PER_GUIDE, Guides
from dermis.mesh.mesh import Mesh
from dermis.mesh.strands import quad_corners

CORNROW_SPACING_MM = 14.0
"""Distance between the middles of cornrows [mm]."""
_MAX_STEP_MM = 5.0  # largest step of the growth of guides
_MIN_HEIGHT_ABOVE_SKIN_MM = 0.5  # least height of guides above the skin, away from their roots
_LAYER_LENGTH_MM = 35.0  # length along which hair rises to the outermost layer
_WHORL_MM = np.array([9.0, 86.0, -131.0])
_SKULL_CENTRE_MM = np.array([0.0, 12.0, -66.0])
_ROUND_CUT_RADII_MM = np.array([75.0, 96.0, 92.0])  # semi-axes of the skull
# Elliptic cylinder around the face that combed hair avoids: centre (z), semi-axes along x and z, and the
# heights between which it begins [mm].
_FACE_CENTRE_Z, _FACE_RADII_MM, _FACE_TOP_MM = -60.0, (74.0, 118.0), (78.0, 40.0)
_ANCHOR_SOFTENING_MM = 6.0  # distance below which the quads that a knot follows have about equal weights
_RESTING_ABOVE_CUT_MM = 45.0  # height above a level cut, below which hair on the shoulders is cut off
_NAPE_TRIM_MM = -70.0, 25.0  # heights of roots between which round cuts grow to their full size
_COMBS_OVER_EARS = "fall", "twist"  # combs of hair that bulges over the ears
_EAR_CENTRE_MM = np.array([75.0, -22.0, -76.0])
_EAR_SPREAD_MM = np.array([1.0, 42.0, 34.0])
_EAR_HEIGHT_MM, _EAR_BEGIN_X = 17.0, 55.0  # height of the ears above the head; x beyond which they begin
_TIE_RADIUS_MM, _TIE_REACH_MM = (
    9.0,
    5.0,
)  # radius of gathered hair at its tie; distance at which a guide is in its place


class Growth(NamedTuple):
    """State of g guides while they grow.

    root_mm, root_normal : (g, 3) roots on the mean person [mm], and unit normals of the skin at the roots
    position_mm : (g, 3) current ends of the guides [mm]
    direction : (g, 3) unit directions of growth at the ends
    skin_normal, height_mm : (g, 3) unit normals of the skin below the ends, and (g,) heights of the ends
        above it [mm]
    length_mm : (g,) current lengths [mm]
    tied_mm : (g,) length at which each guide reached the hair tie [mm]; infinite before that
    """

    root_mm: Doubles
    root_normal: Doubles
    position_mm: Doubles
    direction: Doubles
    skin_normal: Doubles
    height_mm: Doubles
    length_mm: Doubles
    tied_mm: Doubles


def unit_vectors(vectors: Doubles) -> Doubles:
    """Return vectors (n, 3) scaled to length 1; a vector of length 0 stays 0."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9))


def parting_side(points_mm: Doubles, style: Style) -> Doubles:
    """Return the side of the parting on which points (n, 3) lie, as an array (n,): 1 left, -1 right.

    Points behind or below the parting get 0. The parting runs back from the forehead to the whorl, where it
    bends to the middle of the head.
    """
    x, y, z = points_mm.T
    return np.where(
        (z < -125.0) | (y < 35.0),
        0.0,
        np.where(x > style.parting_mm * smoothstep(-140.0, -95.0, z), 1.0, -1.0),
    )


def cornrow_position(points_mm: Doubles) -> Doubles:
    """Return the position (n,) of points across the cornrows, in multiples of the distance between rows."""
    x, y = points_mm[:, 0], points_mm[:, 1] - _SKULL_CENTRE_MM[1]
    return np.asarray(np.arctan2(x, np.maximum(y, -60.0) + 75.0) * 110.0 / CORNROW_SPACING_MM)


def fringe_weight(points_mm: Doubles, style: Style) -> Doubles:
    """Return weights (n,) of points (n, 3) on the scalp: 1 where the fringe has its roots, 0 elsewhere."""
    if style.fringe_y_mm is None:
        return np.zeros(len(points_mm))
    return smoothstep(-48.0, -34.0, points_mm[:, 2]) * smoothstep(66.0, 54.0, np.abs(points_mm[:, 0]))


def _parted_directions(points: Doubles, style: Style) -> Doubles:
    """Return the directions (n, 3) of hair that falls to either side of a parting."""
    x, y, z = points.T
    side, top = (
        np.where(x > style.parting_mm * smoothstep(-140.0, -95.0, z), 1.0, -1.0),
        smoothstep(40.0, 85.0, y),
    )
    ahead = smoothstep(-70.0, 0.0, z)
    sides = np.stack([side * (0.25 + top), -0.9 * (1.0 - top) - 0.1, -0.22 - 0.5 * ahead], axis=1)
    behind = np.stack([x / 200.0, np.full(len(x), -1.0), np.zeros(len(x))], axis=1)
    back, fringe = smoothstep(-110.0, -150.0, z)[:, None], fringe_weight(points, style)[:, None]
    forward = np.stack([x / 120.0, 0.0 * x, np.ones(len(x))], axis=1)
    return np.asarray((1.0 - fringe) * ((1.0 - back) * sides + back * behind) + fringe * forward)


def _swept_back_directions(points: Doubles, style: Style) -> Doubles:
    """Return the directions (n, 3) of hair combed back, and combed down at the nape and below the temples."""
    x, y, z = points.T
    down = np.maximum(smoothstep(60.0, -10.0, y), smoothstep(-100.0, -150.0, z))
    return np.stack([x / 400.0, -0.9 * down, -1.0 + 0.75 * smoothstep(-110.0, -150.0, z)], axis=1)


def _uncombed_directions(points: Doubles, style: Style) -> Doubles:
    """Return the directions (n, 3) of uncombed hair: away from the whorl, and downwards at sides and nape."""
    away = points - _WHORL_MM
    low = 70.0 * smoothstep(40.0, -30.0, points[:, 1])
    return np.asarray(away + np.stack([0.0 * low, -low, -0.3 * low], axis=1))


def _rope_directions(points: Doubles, style: Style) -> Doubles:
    """Return the directions (n, 3) of hair in twists or braids, which hang down on all sides of the head."""
    away = points - np.array([0.0, 100.0, -70.0])
    return np.asarray(away * [1.0, 0.6, 0.9])


def _beard_directions(points: Doubles, style: Style) -> Doubles:
    sideways = 0.4 * np.clip(points[:, 0] / 25.0, -1.0, 1.0)
    return np.stack([sideways, np.full(len(points), -1.0), np.zeros(len(points))], axis=1)


def _tie_directions(points: Doubles, style: Style) -> Doubles:
    return np.asarray(np.array(style.tie_mm) - points)


def _cornrow_directions(points: Doubles, style: Style) -> Doubles:
    """Return the directions (n, 3) of hair in cornrows: backwards, at a constant `cornrow_position`."""
    x, y, z = points.T
    angle = np.arctan2(x, np.maximum(y - _SKULL_CENTRE_MM[1], -60.0) + 75.0)
    down = smoothstep(-90.0, -150.0, z)
    ahead = np.stack([0.0 * x, 0.35 * smoothstep(0.0, 30.0, z), -np.ones(len(x))], axis=1)
    fall = np.stack([0.3 * np.sin(angle), -np.ones(len(x)), 0.1 * np.ones(len(x))], axis=1)
    return np.asarray((1.0 - down)[:, None] * ahead + down[:, None] * fall)


COMBS: dict[str, Callable[[Doubles, Style], Doubles]] = {
    "up": _uncombed_directions,
    "fall": _parted_directions,
    "back": _swept_back_directions,
    "rows": _cornrow_directions,
    "gather": _tie_directions,
    "twist": _rope_directions,
    "beard": _beard_directions,
}
"""Functions that return the combed directions (n, 3) of hair at points (n, 3), by `Style.comb`."""


@cache
def body_surface(root_finder: RootFinder, has_ears: bool = True) -> SkinSurface:
    """Return the skin of the mean person: head, neck and shoulders.

    root_finder : root finder of the mean person
    has_ears : whether the skin has ears; if False, a smooth surface replaces them
    """
    mesh = root_finder.once_subdivided_mesh
    skin = np.unique(mesh.triangles[mesh.material == 0])
    points, normals = mesh.positions[skin].astype(np.float64), mesh.normals[skin].astype(np.float64)
    if has_ears:
        return SkinSurface(points, normals)
    y, z = np.abs(points[:, 1:] - _EAR_CENTRE_MM[1:]).T
    ear = (np.abs(points[:, 0]) > _EAR_BEGIN_X) & (y < 36.0) & (z < 28.0)
    around = ~ear & (points[:, 0] > _EAR_BEGIN_X) & (y < 60.0) & (z < 50.0)
    fit = np.linalg.lstsq(_quadratic_terms(points[around]), points[around, 0], rcond=None)[0]
    grid = np.stack(np.meshgrid(0.0, np.arange(-36.0, 37.0, 4.0), np.arange(-28.0, 29.0, 4.0)), axis=-1)
    filled = grid.reshape(-1, 3) * [0, 1, 1] + _EAR_CENTRE_MM * [0, 1, 1]
    filled[:, 0] = _quadratic_terms(filled) @ fit
    dy, dz = filled[:, 1:].T - _EAR_CENTRE_MM[1:, None]
    slopes = fit[1] + 2 * fit[3] * dy + fit[5] * dz, fit[2] + 2 * fit[4] * dz + fit[5] * dy
    facing = unit_vectors(np.stack([np.ones(len(filled)), -slopes[0], -slopes[1]], axis=1))
    sides = [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]
    return SkinSurface(
        np.concatenate([points[~ear], *(filled * side for side in sides)]),
        np.concatenate([normals[~ear], *(facing * side for side in sides)]),
    )


def _quadratic_terms(points: Doubles) -> Doubles:
    """Return the monomials (n, 6) up to degree 2 in y and z, measured from the middle of the ear."""
    y, z = points[:, 1:].T - _EAR_CENTRE_MM[1:, None]
    return np.stack([np.ones(len(y)), y, z, y * y, z * z, y * z], axis=1)


def ear_weight(points: Doubles) -> Doubles:
    """Return weights (n,) of points (n, 3): 1 at the middle of an ear, falling smoothly to 0 away from it."""
    away = (np.abs(points) * [1, 0, 0] + points * [0, 1, 1] - _EAR_CENTRE_MM) / _EAR_SPREAD_MM
    return np.asarray(np.exp(-(away[:, 1:] ** 2).sum(axis=1)))


def grow_guides(root_finder: RootFinder, roots_mm: Doubles, style: Style) -> tuple[Doubles, Doubles, Doubles]:
    """Return the knots (g, k, 3) of guides [mm], with skin normals (g, k, 3) and heights (g, k) [mm].

    The normals and the heights refer to the skin below each knot.

    roots_mm : (g, 3) roots on the skin of the mean person [mm]
    """
    surface = body_surface(root_finder, has_ears=style.comb not in _COMBS_OVER_EARS)
    count, (_, normal) = len(roots_mm), surface.project(roots_mm)
    state = Growth(roots_mm, normal, roots_mm, _root_directions(roots_mm, normal, style), normal,
                   np.zeros(count), np.zeros(count), np.full(count, np.inf))  # fmt: skip
    knots = [(roots_mm, normal, state.height_mm)]
    segment = style.max_length_mm / (KNOTS_PER_GUIDE - 1)
    substeps = max(1, int(np.ceil(segment / _MAX_STEP_MM)))
    for _ in range(KNOTS_PER_GUIDE - 1):
        for _ in range(substeps):
            state = _grow_one_step(surface, state, segment / substeps, style)
        knots.append((state.position_mm, state.skin_normal, state.height_mm))
    positions, normals, heights = (np.stack(part, axis=1) for part in zip(*knots, strict=True))
    return positions, normals, heights


def _root_directions(points: Doubles, normals: Doubles, style: Style) -> Doubles:
    combed = unit_vectors(tangent_component(COMBS[style.comb](points, style), normals))
    if style.comb == "up":
        return unit_vectors(normals + style.tilt * combed)
    lift = style.lift * (smoothstep(40.0, 95.0, points[:, 1]) if style.comb == "fall" else 1.0)
    return unit_vectors(np.reshape(lift, (-1, 1)) * normals + combed)


def _grow_one_step(surface: SkinSurface, growth: Growth, step_mm: float, style: Style) -> Growth:
    """Return the state of guides after one step of growth.

    step_mm : length of the step [mm]
    """
    direction, length, tied = _next_directions(growth, style), growth.length_mm + step_mm, growth.tied_mm
    if style.comb == "gather":
        near = (
            np.linalg.norm(growth.position_mm - style.tie_mm - _tie_offsets(growth, style), axis=1)
            < _TIE_REACH_MM
        )
        tied = np.where(near & ~np.isfinite(tied), length, tied)
    moved = growth.position_mm + step_mm * direction
    base, normal = surface.project(moved)
    height = ((moved - base) * normal).sum(axis=1)
    height_of_ears = _EAR_HEIGHT_MM * ear_weight(base) if style.comb in _COMBS_OVER_EARS else 0.0
    layer = style.volume_mm * (1.0 - np.exp(-length / _LAYER_LENGTH_MM)) * np.minimum(length / 20.0, 1.0)
    least = np.minimum(length / 6.0, 1.0) * (_MIN_HEIGHT_ABOVE_SKIN_MM + layer + height_of_ears)
    pushed = np.clip(least - height, 0.0, 0.8 * step_mm)[:, None]
    moved += pushed * normal
    if style.comb in _COMBS_OVER_EARS:
        loose = fringe_weight(growth.root_mm, style)[:, None] < 0.5
        moved = np.where(loose, _move_off_face(moved), moved)
    if style.coil_mm:
        wound = np.clip((length - tied) / 25.0, 0.0, 1.0)[:, None]
        moved += wound * (_bun_points(growth, length, style) - moved)
    # hair that is held out slides along the obstacle: it loses its inward motion, but gains no outward motion
    inward = np.minimum((direction * normal).sum(axis=1, keepdims=True), 0.0)
    direction = np.where(
        (pushed > 0) & ~np.isfinite(tied)[:, None], unit_vectors(direction - inward * normal), direction
    )
    base, normal = surface.project(moved)
    height = ((moved - base) * normal).sum(axis=1)
    return growth._replace(position_mm=moved, direction=direction, skin_normal=normal, height_mm=height,
                          length_mm=length, tied_mm=tied)  # fmt: skip


def _next_directions(growth: Growth, style: Style) -> Doubles:
    """Return the unit directions (g, 3) in which guides grow in the next step."""
    free = np.minimum(growth.length_mm / 60.0, 1.0)[:, None] + 0.15
    pull = 4.0 * style.gravity * free * np.array([0.0, -1.0, 0.0])
    if style.comb in ("gather", "rows", "back"):
        combed = unit_vectors(
            tangent_component(COMBS[style.comb](growth.position_mm, style), growth.skin_normal)
        )
        close = np.exp(-np.maximum(growth.height_mm - style.volume_mm, 0.0) / 8.0)[:, None]
        if style.comb == "gather":
            to_tie = np.array(style.tie_mm) + _tie_offsets(growth, style) - growth.position_mm
            distance = np.linalg.norm(to_tie, axis=1, keepdims=True)
            combed = unit_vectors(np.where(distance < 35.0, to_tie, combed))
            tail = _tail_directions(growth, style, pull)
            return np.where(
                np.isfinite(growth.tied_mm)[:, None], tail, unit_vectors(0.5 * growth.direction + combed)
            )
        return unit_vectors(0.6 * growth.direction + 0.8 * close * combed + 0.3 * (1.0 - close) * pull)
    return unit_vectors(style.stiffness * growth.direction + (1.0 - style.stiffness) * pull)


def _tie_offsets(growth: Growth, style: Style) -> Doubles:
    """Return where guides pass through the hair tie of a ponytail or bun, relative to its middle (g, 3) [mm].

    A guide passes through the side of the tie that is nearest to the root of the guide.
    """
    outward = unit_vectors(np.array(style.tie_mm) - _SKULL_CENTRE_MM)
    away = tangent_component(
        growth.root_mm - np.array(style.tie_mm), np.broadcast_to(outward, growth.root_mm.shape)
    )
    reach = np.linalg.norm(away, axis=1, keepdims=True)
    return np.asarray(_TIE_RADIUS_MM * np.minimum(reach / 60.0, 1.0) * unit_vectors(away))


def _tail_directions(growth: Growth, style: Style, gravity_pull: Doubles) -> Doubles:
    """Return the directions (g, 3) of hair beyond the hair tie: outwards, then down and slightly apart.

    gravity_pull : (g, 3) pull of gravity, as vectors
    """
    outward = unit_vectors(np.array(style.tie_mm) - _SKULL_CENTRE_MM)[None]
    since = np.maximum(growth.length_mm - np.where(np.isfinite(growth.tied_mm), growth.tied_mm, 0.0), 0.0)[
        :, None
    ]
    apart = _tie_offsets(growth, style) / _TIE_RADIUS_MM
    spread = 0.12 * np.exp(-since / 60.0) - 0.03 * smoothstep(150.0, 400.0, since)
    return unit_vectors(
        0.85 * growth.direction + 0.15 * gravity_pull + 0.3 * np.exp(-since / 25.0) * outward + spread * apart
    )


def _length_beyond_tie(growth: Growth, length_mm: Doubles) -> Doubles:
    """Return the length (g,) of each guide beyond the hair tie [mm]; 0 before the guide reaches the tie.

    length_mm : (g,) lengths from the roots [mm]
    """
    return np.maximum(length_mm - np.where(np.isfinite(growth.tied_mm), growth.tied_mm, length_mm), 0.0)


def _bun_points(growth: Growth, length_mm: Doubles, style: Style) -> Doubles:
    """Return points (g, 3) on guides that are wound into a bun beyond the hair tie [mm].

    length_mm : (g,) lengths from the roots to the points [mm]
    """
    outward = unit_vectors(np.array(style.tie_mm) - _SKULL_CENTRE_MM)
    side = unit_vectors(np.cross(outward, [0.0, 1.0, 0.0]))
    up = np.cross(side, outward)
    offset = _tie_offsets(growth, style)
    turn = np.arctan2(offset @ up, offset @ side)
    rank = np.linalg.norm(offset, axis=1) / _TIE_RADIUS_MM
    since = _length_beyond_tie(growth, length_mm)
    radius = style.coil_mm * (0.7 + 0.3 * rank)
    tilt = 1.9 - 1.5 * smoothstep(0.0, 260.0, since) + 0.25 * np.sin(3.0 * turn)
    turn = turn + since / (0.8 * radius)
    across = (np.sin(tilt) * np.cos(turn))[:, None] * side + (np.sin(tilt) * np.sin(turn))[:, None] * up
    centre = np.array(style.tie_mm) + 0.6 * style.coil_mm * outward
    return np.asarray(centre + radius[:, None] * (across + np.cos(tilt)[:, None] * outward))


def _move_off_face(points: Doubles) -> Doubles:
    """Return points (g, 3) after moving them sideways out of an elliptic cylinder around the face [mm]."""
    x, y, z = points.T
    along = np.clip((z - _FACE_CENTRE_Z) / _FACE_RADII_MM[1], -1.0, 1.0)
    grown = smoothstep(*_FACE_TOP_MM, y) * smoothstep(-40.0, -5.0, z)
    least = _FACE_RADII_MM[0] * np.sqrt(1.0 - along**2) * grown
    inside = np.clip(least - np.abs(x), 0.0, 2.5)
    return np.asarray(points + np.stack([inside * np.where(x >= 0, 1.0, -1.0), 0.0 * x, 0.0 * x], axis=1))


def cut_fractions(knots: Doubles, style: Style) -> Doubles:
    """Return where each guide is cut, as a fraction (g,) of the guide's length; 1 for uncut guides.

    knots : (g, k, 3) knots of the guides on the mean person [mm]
    """
    cut = np.ones(len(knots))
    root = knots[:, 0]
    if style.cut_y_mm is not None:
        cut = np.minimum(cut, _first_crossing_fractions(knots, np.full(len(knots), style.cut_y_mm)))
        cut = np.minimum(cut, _first_resting_fractions(knots, style.cut_y_mm + _RESTING_ABOVE_CUT_MM))
    if style.fringe_y_mm is not None:
        fringe = fringe_weight(root, style) > 0.5
        cut = np.where(fringe, _first_crossing_fractions(knots, np.full(len(knots), style.fringe_y_mm)), cut)
    if style.round:
        radius = np.linalg.norm((knots - _SKULL_CENTRE_MM) / _ROUND_CUT_RADII_MM, axis=2)
        trimmed = smoothstep(*_NAPE_TRIM_MM, root[:, 1])[:, None]  # shorter towards the nape
        limit = 1.0 + style.round * style.max_length_mm / 90.0 * (0.25 + 0.75 * trimmed)
        outside = radius > limit
        first = np.where(outside.any(axis=1), outside.argmax(axis=1), KNOTS_PER_GUIDE - 1)
        cut = np.minimum(cut, first / (KNOTS_PER_GUIDE - 1))
    return cut


def _first_resting_fractions(knots: Doubles, below_y_mm: float) -> Doubles:
    """Return where each curve first rests on the shoulders or the back, as a fraction (g,) of its length.

    A curve rests where its segments descend by less than two thirds of their length. The fraction is 1 for
    curves that rest nowhere.

    knots : (g, k, 3) knots of the curves [mm]
    below_y_mm : height below which curves can rest [mm]
    """
    steps = np.diff(knots, axis=1)
    flat = -steps[..., 1] < 2.0 / 3.0 * np.linalg.norm(steps, axis=2)
    resting = flat & (knots[:, :-1, 1] < below_y_mm)
    return np.where(resting.any(axis=1), resting.argmax(axis=1) / (KNOTS_PER_GUIDE - 1), 1.0)


def _first_crossing_fractions(knots: Doubles, height_mm: Doubles) -> Doubles:
    """Return where each curve first falls below a height, as a fraction (g,) of the curve's length.

    The fraction is 1 for curves that do not fall below the height.

    knots : (g, k, 3) knots of the curves [mm]
    height_mm : (g,) height for each curve [mm]
    """
    y = knots[..., 1] - height_mm[:, None]
    crosses = (y[:, 1:] < 0) & (y[:, :-1] >= 0)
    first = crosses.argmax(axis=1)
    row = np.arange(len(y))
    part = y[row, first] / np.maximum(y[row, first] - y[row, first + 1], 1e-9)
    return np.where(crosses.any(axis=1), (first + part) / (KNOTS_PER_GUIDE - 1), 1.0)


def bind_guides(
    control_mesh: Mesh, points_mm: Doubles, knots: Doubles, heights_mm: Doubles, cut_fraction: Doubles
) -> Guides:
    """Return guides that move with the skin: each knot follows the quads nearest to it.

    control_mesh : control mesh of the mean person
    points_mm : (p, 3) positions of the control points on the subdivided mean person [mm]
    knots : (g, k, 3) knots from `grow_guides` [mm]
    heights_mm : (g, k) heights of the knots above the skin, from `grow_guides` [mm]
    cut_fraction : (g,) fractions from `cut_fractions`
    """
    from scipy.spatial import cKDTree

    skin = np.flatnonzero(control_mesh.material[control_mesh.quads[:, 0]] == 0)
    corners = quad_corners(control_mesh, skin)
    around = points_mm[corners]
    distance, near = cKDTree(around.mean(axis=1)).query(knots, k=ANCHORS_PER_GUIDE_KNOT)
    weight = np.asarray(1.0 / (distance**2 + _ANCHOR_SOFTENING_MM**2))
    weight /= weight.sum(axis=-1, keepdims=True)
    origin, axes = quad_frames(around)
    local = np.einsum("gkaic,gkac->gkai", axes[near], knots[:, :, None] - origin[near])
    return Guides(
        corners[near].astype(np.int32),
        local.astype(np.float32),
        weight.astype(np.float32),
        np.concatenate([knots, heights_mm[..., None]], axis=2).astype(np.float32),
        cut_fraction.astype(np.float32),
    )


def quad_frames(corners_mm: Doubles) -> tuple[Doubles, Doubles]:
    """Return the centres (q, 3) [mm] and the coordinate frames (q, 3, 3) of quads.

    The rows of a frame are its axes: along the quad, across it, and along its normal.

    corners_mm : (q, 4, 3) corners of the quads [mm]
    """
    a, b, c, d = corners_mm.swapaxes(0, 1)
    along = unit_vectors((b - a) + (c - d))
    normal = np.cross(c - a, d - b)
    normal = unit_vectors(normal - (normal * along).sum(axis=1, keepdims=True) * along)
    return corners_mm.mean(axis=1), np.stack([along, np.cross(normal, along), normal], axis=1)
