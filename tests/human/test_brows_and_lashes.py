"""Brows and lashes of the parametric human: positions, and motion with the skin."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Human, Pose
from dermis.human.hair.skin_surface import SkinSurface
from dermis.mesh.head import Head

Floats = NDArray[np.float64]
BROW_Y = 6.0  # hairs rooted above it are brows, on people of usual size [mm]
PEOPLE = [
    Human(),
    Human(sex=1.0, age=75, african=1, asian=0, caucasian=0, weight=0.5),
    Human(asian=1, african=0, caucasian=0, age=25),
    Human.sampled(4),
]


@cache
def grown(index: int = 0) -> Head:
    return PEOPLE[index].head()


def knots(head: Head, **pose: float) -> Floats:
    """Return the knots (n, k, 3) in space [mm]."""
    assert head.strands is not None
    points = (
        head.mesh.points_mm
        if not pose
        else head.control_rig.posed_points_mm(Pose.coerce(pose).to_arrays(head.control_rig))
    )
    return head.strands.knot_positions_mm(head.mesh, points)


def lashes(head: Head) -> NDArray[np.bool_]:
    return np.asarray(knots(head)[:, 0, 1] < BROW_Y)


@pytest.mark.parametrize("index", range(len(PEOPLE)))
def test_hairs_are_of_their_usual_size(index: int) -> None:
    head = grown(index)
    assert head.strands is not None
    places, radius = knots(head), head.strands.radius_mm
    length = np.linalg.norm(np.diff(places, axis=1), axis=2).sum(axis=1)
    brows = ~lashes(head)
    assert 2 * 550 < brows.sum() < 2 * 1100 and (~brows).sum() == 2 * (220 + 116)
    assert length[brows].min() > 1.9 and length[brows].max() < 14.0
    assert length[~brows].min() > 1.2 and length[~brows].max() < 12.0
    assert (2 * radius.max(axis=1) > 0.022).all() and 2 * radius.max() < 0.1
    assert (radius[:, -1] < 0.4 * radius.max(axis=1)).all()


@pytest.mark.parametrize("index", range(len(PEOPLE)))
def test_brows_lie_on_the_skin(index: int) -> None:
    head = grown(index)
    brows = knots(head)[~lashes(head)]
    project, normal = SkinSurface(head.mesh.positions, head.mesh.normals).project(brows.reshape(-1, 3))
    over = ((brows.reshape(-1, 3) - project) * normal).sum(axis=1).reshape(brows.shape[:2])
    assert (over[:, 3:] > 0.0).mean() > 0.99 and over.max() < 2.0
    assert over[:, 0].max() < 0.1  # none floats: they begin at the skin
    assert (np.sign(brows[:, 0, 0]) > 0).mean() == pytest.approx(0.5, abs=0.05)


@pytest.mark.parametrize("index", range(len(PEOPLE)))
def test_lashes_leave_the_eyes(index: int) -> None:
    """Check that lashes are outside of the eyeballs and in front of them."""
    head = grown(index)
    tips = knots(head)[lashes(head)]
    for name, side in (("left eye", 1.0), ("right eye", -1.0)):
        number = [one.name for one in head.mesh.materials].index(name)
        ball = head.mesh.positions[np.unique(head.mesh.triangles[head.mesh.material == number])]
        middle = 0.5 * (ball.min(axis=0) + ball.max(axis=0))
        radius = float(np.median(np.linalg.norm(ball - middle, axis=1)))
        mine = tips[np.sign(tips[:, 0, 0]) == side]
        away = np.linalg.norm(mine - middle, axis=2)
        assert (away[:, 2:] > radius).all()
        assert (np.diff(away[:, 1:], axis=1).mean(axis=1) > 0).all()


def test_the_same_person_has_the_same_hairs() -> None:
    first, second = Human().head().strands, grown().strands
    assert first is not None and second is not None
    assert np.array_equal(first.knots_mm, second.knots_mm)
    assert np.array_equal(first.absorption, second.absorption)


def test_a_blink_takes_upper_lashes_along() -> None:
    head = grown()
    still, closed = knots(head), knots(head, eyeBlinkLeft=1.0)
    upper = lashes(head) & (still[:, -1, 1] > still[:, 0, 1]) & (still[:, 0, 0] > 0)
    moved = (closed - still)[upper]
    assert upper.sum() > 100
    assert np.median(moved[:, 0, 1]) < -4.0  # roots go down
    assert (np.median(moved[:, -1, 1]) - np.median(moved[:, 0, 1])) < -1.0  # tips farther: the hairs turn
    right = still[:, 0, 0] < 0
    assert np.abs((closed - still)[right]).max() < 0.3
    assert np.isfinite(closed).all()


def test_brows_rise_with_the_skin() -> None:
    head = grown()
    still, raised = knots(head), knots(head, browOuterUpLeft=1.0)
    outer = ~lashes(head) & (still[:, 0, 0] > 35)
    assert np.median((raised - still)[outer][..., 1]) > 1.0


def test_people_at_random_have_hair_of_their_ancestry() -> None:
    fair = [Human.sampled(seed, caucasian=1.0).hair_eumelanin for seed in range(100)]
    dark = [one.hair_eumelanin for one in map(Human.sampled, range(300)) if one.caucasian < 0.2]
    dark += [Human.sampled(seed, skin_ancestry="south asian").hair_eumelanin for seed in range(50)]
    assert min(dark) > 3.0 and min(fair) < 0.6 and np.median(fair) < 2.5 < 6.0 < np.median(dark)


def test_hairs_are_coloured_by_their_pigments() -> None:
    blond, black = (Human(hair_eumelanin=much).head(subdivide=0).strands for much in (0.3, 8.0))
    assert blond is not None and black is not None
    assert np.allclose(np.median(black.absorption[:, 0] / blond.absorption[:, 0]), 8.0 / 0.3, rtol=0.5)
    old = Human(age=85, sex=1.0).head(subdivide=0).strands
    assert old is not None and 0.3 < (old.absorption.max(axis=1) == 0.0).mean() < 0.8
    with pytest.raises(Exception, match="hair_eumelanin"):
        Human(hair_eumelanin=-1.0)
