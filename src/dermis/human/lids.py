"""Eyelids fitted to eyeballs of anatomical size, and the morph targets that close them."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dermis.human.makehuman import EXPRESSION_PREFIX, Points, makehuman_arrays, target_deltas
from dermis.human.movement import expression_targets, gaze_rotations
from dermis.human.skin.surface import average_surface, lid_rings
from dermis.mesh.eyeball import SCLERA_MM, LidContact, build_eyeball, radial_distances_mm

Index = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

MAKEHUMAN_EYE_RADIUS_MM = 15.4
"""Mean radius of the average person's eyeball in MakeHuman; MakeHuman's lids touch this eyeball [mm]."""
EYE_FORWARD_OFFSET_MM = 2.2
"""How far the smaller anatomical eyeball is in front of MakeHuman's, to align the corneas [mm]."""
EYEBALL_CONTROL_MESH_SCALE = 1.0045
"""Size of an eyeball's control mesh relative to its smooth surface."""
_MAX_SKIN_TO_LID_MM = 15.0  # distance up to which skin follows the lids
_SKIN_BLEND_DISTANCE_MM = 1.0  # blend distance between the lid points that skin follows
_MIN_LID_HEIGHT_MM = -1.5  # of lid points above the eyeball; deeper points are never visible
# fractions of the radius, see `_compress_radius`
_MAX_UNCOMPRESSED_RADIUS, _MAX_COMPRESSED_RADIUS = 0.75, 0.95
_MIN_LID_CLEARANCES_MM = -0.3, 0.25, 0.75, 1.0  # minimum distances of wall, edge, crest and skin from the eye
_LID_EDGE_HEIGHT_MM = 0.2  # of lid edges above the eye, as the smooth surface lies inside its control points
_LID_ROW_CONTACT = np.array([0, 0.2, 0.6, *21 * [1.0], 0.6, 0.2, 0, 0])
"""Contact of each row of lid_rings.csv with the eyeball, 0 to 1; none around the caruncle."""
_CARUNCLE_RISE_MM = np.array([[0.3, 0.7, 0.0, 0.0], [0.0, 0.2, 0.0, 0.0], *23 * [4 * [0.0]],
                         [0.0, 0.3, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0], [0.6, 1.1, 0.0, 0.0]])  # fmt: skip
"""Rise of the floor of the inner eye corner while the eye is open, by row and column of `lid_rings` [mm]."""
_UPPER_LID_ROWS, _LOWER_LID_ROWS = (
    slice(1, 12),
    slice(13, 28),
)  # rows of lid_rings.csv that hold the upper and the lower lid
_LID_OVERLAP_MM = 1.6 * np.array([0.4, 0.8, *7 * [1.0], 0.8, 0.4])
"""Overlap of a closed upper lid over the lower lid, for each of the rows `_UPPER_LID_ROWS` [mm]."""
_SLIDING_QUAD_ROWS = 6  # rows of quads around the lids that may slide over the eye
_MIN_BLINK_DISPLACEMENT_MM = 2.0  # minimum displacement of sliding skin by a blink
_RING_COUNT, _EDGE_COLUMN, _CREST_COLUMN = (
    4,
    1,
    2,
)  # number of columns of lid_rings.csv, and indices of two of them
REST_GAZE = np.array([0.0, 0.0, 1.0])
"""Viewing direction of the eyes in rest pose."""
_LID_TARGET_PREFIXES = "eyeBlink", "eyeLook", "eyeSquint", "eyeWide"
Doubles = NDArray[np.float64]


class EyeSocket(NamedTuple):
    """Position and size of one of a person's eyeballs, as MakeHuman models it.

    centre : (3,) centre of MakeHuman's eyeball [mm]
    size : radius relative to MakeHuman's eyeball of the average person [-]
    """

    centre: Points
    size: float


class LidSide(NamedTuple):
    """Indices and weights of the control points that move with the eyelids of one eye.

    rings : (r,) indices of the lid points, row by row of lid_rings.csv
    point : (n,) indices of the lid points and of the points of the surrounding skin
    weights : (n, r) weight, 0 to 1, with which each point in `point` follows each point in `rings`
    contact : (c,) indices of the points that slide over the eye
    clearances_mm : (c,) minimum distances of these points from the eye [mm]
    """

    rings: Index
    point: Index
    weights: Points
    contact: Index
    clearances_mm: Points

    def with_renumbered_points(self, sorted_points: Index) -> LidSide:
        """Return a copy with indices into the array `sorted_points` instead of point indices.

        sorted_points : sorted point indices, which include all points of the lids
        """
        names = "rings", "point", "contact"
        return self._replace(**{name: np.searchsorted(sorted_points, getattr(self, name)) for name in names})


def fit_socket(eyeball_points: Points) -> EyeSocket:
    """Return the centre and relative size of MakeHuman's eyeball, computed from its points (b, 3) [mm]."""
    centre = (eyeball_points.min(axis=0) + eyeball_points.max(axis=0)) / 2
    return EyeSocket(
        centre, float(np.linalg.norm(eyeball_points - centre, axis=1).mean()) / MAKEHUMAN_EYE_RADIUS_MM
    )


def fit_lids(
    points_mm: Points,
    sockets: tuple[EyeSocket, EyeSocket],
    is_closed: bool = False,
    gaze_axis: Points = REST_GAZE,
) -> Points:
    """Return a person's points (n, 3) after fitting the lids to eyeballs of anatomical size [mm].

    points_mm : (n, 3) MakeHuman's points of the person [mm]
    sockets : sockets of the left and the right eye
    is_closed : whether the upper lids are lowered onto the lower lids
    gaze_axis : (3,) unit viewing direction of the eyes
    """
    fitted = points_mm.copy()
    for side, eye in zip(lid_sides(), sockets, strict=True):
        _project_lids(fitted, side, eye, is_closed, gaze_axis)
    return fitted


def _project_lids(
    points: Points, lid_side: LidSide, socket: EyeSocket, is_closed: bool | BoolArray, gaze_axis: Points
) -> None:
    """Move the lids of one eye onto its eyeball in place, for one person or for m poses of a person.

    points : (n, 3) points of the person, or (m, n, 3) for m poses [mm]
    lid_side, socket : points that move with the lids of the eye, and socket of the eye
    is_closed : whether the upper lid is lowered onto the lower lid; (m,) for m poses
    gaze_axis : (3,) unit viewing direction of the eye; (m, 1, 3) for m poses
    """
    points[..., lid_side.point, :] += lid_side.weights @ _lid_displacements(
        points[..., lid_side.rings, :], socket, is_closed
    )
    centre = socket.centre + socket.size * EYE_FORWARD_OFFSET_MM * REST_GAZE
    size = EYEBALL_CONTROL_MESH_SCALE * socket.size
    relative = (points[..., lid_side.contact, :] - centre) / size
    distance, surface = radial_distances_mm(relative, gaze_axis)
    scale = np.maximum(1.0, (surface + lid_side.clearances_mm) / distance)
    points[..., lid_side.contact, :] = centre + size * relative * scale[..., None]


def lid_contact(
    first_eye_point: int, eyeball_point_count: int, apex_point: int, back_point: int
) -> LidContact:
    """Return the lid points that slide over the eyeballs, with minimum distances from the eyeballs.

    first_eye_point : index of the first point of the left eyeball
    eyeball_point_count : number of points of an eyeball; the right eyeball's points follow the left eyeball's
    apex_point, back_point : indices of the front and rear poles within an eyeball's points
    """
    both = lid_sides()
    return LidContact(
        np.concatenate([side.contact for side in both]).astype(np.int32),
        np.repeat(np.arange(2, dtype=np.int32), [len(side.contact) for side in both]),
        np.concatenate([side.clearances_mm for side in both]).astype(np.float32),
        np.array(
            [first_eye_point + apex_point, first_eye_point + eyeball_point_count + apex_point], np.int32
        ),
        np.array(
            [first_eye_point + back_point, first_eye_point + eyeball_point_count + back_point], np.int32
        ),
        lid_rings()[..., _EDGE_COLUMN].astype(np.int32),
    )


def _lid_displacements(rings: Points, socket: EyeSocket, lid_is_closed: bool | BoolArray) -> Points:
    """Return the displacements (..., r, 3) that move MakeHuman's lids onto an anatomical eyeball [mm].

    The x and y of open lids change only near the outline of the eyeball. The edges of the lids touch the
    eyeball, and the lids keep their thickness.

    rings : (..., r, 3) positions of the lid points of lid_rings.csv, as MakeHuman models them [mm]
    socket : socket of the eye
    lid_is_closed : (...) whether the upper lid is lowered onto the lower lid
    """
    published = (rings - socket.centre) / socket.size
    relative, is_closed = published.copy(), np.asarray(lid_is_closed)
    lids = relative.reshape(-1, len(_LID_ROW_CONTACT), _RING_COUNT, 3)
    for one in np.flatnonzero(is_closed):
        _close_upper_lid(lids[one])
    above = np.linalg.norm(published, axis=-1) - MAKEHUMAN_EYE_RADIUS_MM
    above = above.reshape(*is_closed.shape, -1, _RING_COUNT)
    above += (_LID_ROW_CONTACT * (_LID_EDGE_HEIGHT_MM - above[..., _EDGE_COLUMN]))[..., None]
    radius = SCLERA_MM + np.maximum(above.reshape(*is_closed.shape, -1), _MIN_LID_HEIGHT_MM)
    across = np.linalg.norm(relative[..., :2], axis=-1)
    target_radius = radius * _compress_radius(across / radius)
    floor = np.where(is_closed[..., None], 0.0, _CARUNCLE_RISE_MM.ravel())
    depth = EYE_FORWARD_OFFSET_MM + np.sqrt(radius**2 - target_radius**2) + floor
    front = relative[..., :2] * (target_radius / np.maximum(across, 1e-9))[..., None]
    return np.asarray(socket.size * (np.concatenate([front, depth[..., None]], axis=-1) - published))


def _close_upper_lid(rings: Points) -> None:
    """Lower an upper lid in place until its margin overlaps the margin of the lower lid.

    rings : (rows, 4, 3) lid points by row and column of lid_rings.csv, relative to the centre of the eye
    """
    crest = rings[:, _CREST_COLUMN]
    lower = crest[_LOWER_LID_ROWS][np.argsort(crest[_LOWER_LID_ROWS, 0])]
    ends = np.interp(crest[_UPPER_LID_ROWS, 0], lower[:, 0], lower[:, 1]) - _LID_OVERLAP_MM
    rings[_UPPER_LID_ROWS, :, 1] += (ends - crest[_UPPER_LID_ROWS, 1])[:, None]


def _compress_radius(axis_distance: Points) -> Points:
    """Limit distances of lid points from the viewing axis smoothly, so that the points stay on the eyeball.

    axis_distance : original distances, divided by the radius of the eyeball [-]
    """
    room = _MAX_COMPRESSED_RADIUS - _MAX_UNCOMPRESSED_RADIUS
    compressed = _MAX_UNCOMPRESSED_RADIUS + room * np.tanh((axis_distance - _MAX_UNCOMPRESSED_RADIUS) / room)
    return np.where(axis_distance < _MAX_UNCOMPRESSED_RADIUS, axis_distance, compressed)


@cache
def lid_sides() -> tuple[LidSide, LidSide]:
    """Return the lid points of the left and the right eye, which are the same for all people."""
    points_mm, (left, right) = average_surface()[0].astype(np.float64), lid_rings()
    body = np.unique(makehuman_arrays()["quads"][makehuman_arrays()["group"] == 0]).astype(np.int64)
    return _lid_side(left, points_mm, body, "Left"), _lid_side(right, points_mm, body, "Right")


def _lid_side(rings: Index, points_mm: Points, body_points: Index, side_name: str) -> LidSide:
    ring_points = rings.ravel()
    centre = points_mm[ring_points].mean(axis=0)
    near = body_points[np.abs(points_mm[body_points] - centre).max(axis=1) < 4 * _MAX_SKIN_TO_LID_MM]
    distance = np.linalg.norm(points_mm[near][:, None] - points_mm[ring_points], axis=-1)
    within = distance.min(axis=1) < _MAX_SKIN_TO_LID_MM
    point, distance = near[within], distance[within]
    weights = 1.0 / (distance**2 + _SKIN_BLEND_DISTANCE_MM**2) ** 2
    weights /= weights.sum(axis=1, keepdims=True)
    t = distance.min(axis=1) / _MAX_SKIN_TO_LID_MM
    weights *= (1.0 - t * t * (3.0 - 2.0 * t))[:, None]
    is_ring = np.isin(point, ring_points)
    weights[is_ring] = point[is_ring][:, None] == ring_points
    sliding = _sliding_points(rings, point, side_name)
    clear = np.concatenate(
        [np.repeat(_MIN_LID_CLEARANCES_MM, len(rings)), np.full(len(sliding), _MIN_LID_CLEARANCES_MM[-1])]
    )
    return LidSide(ring_points, point, weights, np.concatenate([rings.T.ravel(), sliding]), clear)


def _sliding_points(rings: Index, candidate_points: Index, side_name: str) -> Index:
    """Return the indices (c,) of the skin points outside the lid rings that slide over the eye in a blink.

    rings : (rows, 4) lid points from lid_rings.csv
    candidate_points : (n,) indices of the points to select from
    side_name : "Left" or "Right"
    """
    index = target_deltas().names.index(f"{EXPRESSION_PREFIX}eyeBlink{side_name}")
    part = slice(*target_deltas().first[index : index + 2])
    is_far = np.linalg.norm(target_deltas().delta_mm[part], axis=1) > _MIN_BLINK_DISPLACEMENT_MM
    moving = np.intersect1d(target_deltas().point[part][is_far], candidate_points)
    quads, skin = makehuman_arrays()["quads"].astype(np.int64), rings[:, -1]
    quads = quads[np.isin(quads, moving).any(axis=1) & ~np.isin(quads, rings[:, :-1]).any(axis=1)]
    for _ in range(_SLIDING_QUAD_ROWS):  # from the lids outwards
        skin = np.union1d(skin, quads[np.isin(quads, skin).any(axis=1)])
    return np.setdiff1d(np.intersect1d(skin, moving), rings)


def fit_lid_targets(points_mm: Points, sockets: tuple[EyeSocket, EyeSocket]) -> NDArray[np.float32]:
    """Return the displacements (m, 3) of `expression_targets`, adjusted to a person's fitted lids [mm].

    points_mm : (n, 3) MakeHuman's points of the person [mm]
    sockets : sockets of the left and the right eye
    """
    lids, delta_mm = _lid_targets(), expression_targets().delta_mm.copy()
    rest_points = points_mm[lids.point]
    posed = np.tile(rest_points, (len(lids.closed), 1, 1))
    posed[lids.target, lids.point_index] += delta_mm[lids.row]
    for side, eye, target_index in zip(lids.lid_sides, sockets, lids.target_index, strict=True):
        _project_lids(rest_points, side, eye, False, REST_GAZE)
        near = posed[target_index]
        _project_lids(near, side, eye, lids.closed[target_index], lids.axis[target_index])
        posed[target_index] = near
    delta_mm[lids.row] = posed[lids.target, lids.point_index] - rest_points[lids.point_index]
    return delta_mm


class _LidTargets(NamedTuple):
    """Arrays for the t morph targets that move the lids; they are the same for all people.

    closed : (t,) mask of the targets that close the lids
    axis : (t, 1, 3) viewing direction of the eyes when each target is active
    point : (n,) indices of the points around both eyes
    lid_sides : lid points of the left and of the right eye, as indices into `point`
    target_index : indices, 0 to t - 1, of the targets that move the left eye's lid points, then of those that
        move the right eye's
    row : (m,) indices into `MorphTargets.delta_mm` that select the displacements of points around the eyes
    target : (m,) index, 0 to t - 1, of the target that causes each selected displacement
    point_index : (m,) index into `point` of the point that each selected displacement moves
    """

    closed: BoolArray
    axis: Points
    point: Index
    lid_sides: tuple[LidSide, ...]
    target_index: tuple[Index, ...]
    row: Index
    target: Index
    point_index: Index


@cache
def _lid_targets() -> _LidTargets:
    sides, expressions = lid_sides(), expression_targets()
    point = np.unique(np.concatenate([side.point for side in sides]))
    names = [name for name in expressions.names if name.startswith(_LID_TARGET_PREFIXES)]
    index = [expressions.names.index(name) for name in names]
    parts = [np.arange(*expressions.first[k : k + 2]) for k in index]
    rows = [part[np.isin(expressions.point[part], point)] for part in parts]
    near = [[np.isin(expressions.point[row], side.point).any() for row in rows] for side in sides]
    row = np.concatenate(rows)
    return _LidTargets(
        np.array(["Blink" in name for name in names]),
        np.array([gaze_axes().get(name, REST_GAZE) for name in names])[:, None],
        point,
        tuple(side.with_renumbered_points(point) for side in sides),
        tuple(np.flatnonzero(one) for one in near),
        row,
        np.repeat(np.arange(len(rows)), [len(one) for one in rows]),
        np.searchsorted(point, expressions.point[row]),
    )


@cache
def gaze_axes() -> dict[str, Points]:
    """Return a dictionary from the name of a gaze target to the eye's viewing direction (3,) at weight 1."""
    angles = {rotation.target: np.radians(rotation.degrees) for rotation in gaze_rotations()}
    axes = {}
    for name, (x, y, _) in angles.items():
        axis = np.array([np.sin(y), -np.sin(x), np.cos(x) * np.cos(y)])
        axes[name] = axis / np.linalg.norm(axis)
    return axes


def eyeball_mesh() -> tuple[Doubles, Index]:
    """Return the control points (n, 3) [mm] and quads (q, 4) of an average eyeball at the origin.

    The eyeball looks along +Z.
    """
    return build_eyeball(position_scale=EYEBALL_CONTROL_MESH_SCALE)


def place_eyeball(socket: EyeSocket) -> tuple[Doubles, Doubles]:
    """Return the control points (n, 3) and the centre (3,) of the anatomical eyeball in a socket [mm]."""
    centre = socket.centre + socket.size * EYE_FORWARD_OFFSET_MM * REST_GAZE
    return centre + socket.size * eyeball_mesh()[0], centre
