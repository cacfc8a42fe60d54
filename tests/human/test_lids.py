"""Lids on anatomical eyeballs: contact, sliding and closing, for several people."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Human
from dermis.human import lids
from dermis.human.lids import fit_lid_targets, fit_lids, gaze_axes
from dermis.human.makehuman import morphed_points_mm
from dermis.human.model import _eye_sockets, build_head
from dermis.human.movement import expression_targets
from dermis.human.skin.surface import lid_rings
from dermis.mesh.eyeball import SCLERA_MM, apex_mm, radial_distances_mm
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.pose import Pose
from dermis.mesh.subdivide import subdivide_head

Floats = NDArray[np.float64]
PEOPLE = [None, 3, 7, 12, 21]
ON_BALL = slice(3, 24)
"""Rows of the lids' rings that lie on the ball, not beside the caruncle."""
EDGE, CREST, SKIN = 1, 2, 3
TOUCHES_MM = -0.3, 0.5
"""Of the surface's edge from the ball."""
UP, LOW = slice(3, 12), slice(14, 24)
POSES: list[Mapping[str, float]] = [
    *({"eyeBlinkLeft": weight} for weight in (0.0, 0.25, 0.5, 0.75, 1.0)),
    {"eyeLookDownLeft": 1.0},
    {"eyeLookUpLeft": 1.0},
    {"eyeLookOutLeft": 1.0, "eyeBlinkLeft": 0.6},
    {"eyeWideLeft": 1.0},
    {"eyeSquintLeft": 1.0, "eyeBlinkLeft": 0.3},
]


def person_of(seed: int | None) -> Human:
    return Human() if seed is None else Human.sampled(seed)


@cache
def head_of(seed: int | None) -> Head:
    person = person_of(seed)
    return subdivide_head(build_head(person.target_weights(), Maps(), "own", person.iris), 1)


def rings(seed: int | None, weights: Mapping[str, float]) -> tuple[Floats, Floats]:
    """Return the left eye's rings (28, 4, 3) in the eye's coordinates, and their distances from it [mm]."""
    head = head_of(seed)
    assert head.eyes is not None
    pose_arrays = Pose(weights).to_arrays(head.control_rig)
    points = head.control_rig.posed_points_mm(pose_arrays)[lid_rings()[0]]
    frame = head.eyes.eye_matrices(head.control_rig, pose_arrays)[0]
    own = points @ frame[:3, :3].T + frame[:3, 3]
    far, surface = radial_distances_mm(own, np.array([0.0, 0.0, 1.0]))
    return own, far - surface


def test_eyeball_has_its_real_size() -> None:
    assert SCLERA_MM == 12.0 and 24.0 < SCLERA_MM + apex_mm() < 25.5  # an adult's eye is 24 to 25 mm long


@pytest.mark.parametrize("seed", PEOPLE)
@pytest.mark.parametrize("weights", POSES, ids=str)
def test_lids_touch_the_eye_and_none_pokes_through(seed: int | None, weights: Mapping[str, float]) -> None:
    _, off = rings(seed, weights)
    edges = off[ON_BALL, EDGE]
    assert TOUCHES_MM[0] < edges.min() and edges.max() < TOUCHES_MM[1]
    assert off[ON_BALL, CREST].min() > 0.2 and off[:, SKIN].min() > 0.4


@pytest.mark.parametrize("seed", PEOPLE)
def test_targets_together_take_no_lid_into_the_eye(seed: int | None) -> None:
    _, off = rings(seed, {"eyeLookDownLeft": 1.0, "eyeBlinkLeft": 0.7, "eyeSquintLeft": 0.5})
    assert off[ON_BALL, CREST].min() > 0.2 and off[ON_BALL, EDGE].max() < 1.5


@pytest.mark.parametrize("seed", PEOPLE)
def test_without_contact_a_lid_that_travels_straight_cuts_into_the_eye(seed: int | None) -> None:
    head = head_of(seed)
    rig = head.control_rig
    assert rig.contact is not None
    pose_arrays = Pose({"eyeBlinkLeft": 0.5}).to_arrays(rig)
    straight = rig.positions_mm.astype(float)
    each = np.repeat(pose_arrays.weights, np.diff(rig.targets.first))
    np.add.at(straight, rig.targets.point, each[:, None] * rig.targets.delta_mm)
    moved = np.linalg.norm(rig.contact.push_out(straight) - straight, axis=1)
    assert 0.4 < moved.max() < 2.5


@pytest.mark.parametrize("seed", [*PEOPLE, *range(30, 40)])
def test_closed_lids_touch(seed: int | None) -> None:
    """Check that the upper crest ends slightly below the lower one."""
    own, _ = rings(seed, {"eyeBlinkLeft": 1.0})
    lower = own[LOW, CREST][::-1]
    over = np.interp(own[UP, CREST, 0], lower[:, 0], lower[:, 1]) - own[UP, CREST, 1]
    assert over.min() > 0.3 and over.max() < 3.0


@pytest.mark.parametrize("seed", PEOPLE)
def test_seen_from_the_front_the_opening_stays_as_published(seed: int | None) -> None:
    person = person_of(seed)
    places = morphed_points_mm(person.target_weights())
    head = head_of(seed)
    crest = lid_rings()[..., CREST]
    off = head.positions_mm[crest] - places[crest]
    assert np.abs(off[:, 1:12, 1]).max() < 0.5 and np.abs(off[..., :2]).max() < 2.0
    assert off[..., 2].min() < -1.0  # they were drawn back


def test_skin_far_from_the_eyes_stays_where_it_is() -> None:
    from dermis.human.model import _eye_sockets

    places = morphed_points_mm({})
    moved = np.abs(fit_lids(places, _eye_sockets(places)) - places).max(axis=1)
    middle = places[lid_rings()].reshape(2, -1, 3).mean(axis=1)
    far = np.linalg.norm(places[:, None] - middle, axis=-1).min(axis=1)
    assert moved[far > 32].max() == 0.0 and moved.max() > 2.0
    edge = moved[(far > 24) & (far < 32)]
    assert edge.max() < 1.0


def test_lids_fit_other_people() -> None:
    """Check that contact uses the positions of that person's eyes."""
    head, other = head_of(None), Human.sampled(7)
    pose_arrays = Pose({"eyeBlinkLeft": 0.5}, positions_mm=other.positions_mm).to_arrays(head.control_rig)
    assert head.eyes is not None
    points = head.control_rig.posed_points_mm(pose_arrays)[lid_rings()[0]]
    frame = head.eyes.eye_matrices(head.control_rig, pose_arrays)[0]
    far, surface = radial_distances_mm(points @ frame[:3, :3].T + frame[:3, 3], np.array([0.0, 0.0, 1.0]))
    assert (far - surface)[ON_BALL, CREST].min() > 0.0


def test_targets_are_corrected_wherever_they_move_a_lid() -> None:
    """Compare with a correction of both eyes for each target; blinks move the other eye's inner corner."""
    places = morphed_points_mm(Human.sampled(3).target_weights())
    sockets = _eye_sockets(places)
    found, resting = fit_lid_targets(places, sockets), fit_lids(places, sockets)
    targets = expression_targets()
    for name in ("eyeBlinkLeft", "eyeLookOutRight", "eyeLookUpLeft", "eyeWideRight"):
        part, moved = targets.displacement_rows(targets.index_by_name[name]), places.copy()
        point = targets.point[part]
        moved[point] += targets.delta_mm[part]
        drawn = fit_lids(moved, sockets, "Blink" in name, gaze_axes().get(name, lids.REST_GAZE))
        assert found[part] == pytest.approx((drawn - resting)[point], abs=1e-5)
