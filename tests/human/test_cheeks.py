"""Cheeks that bunch in smiles."""

from __future__ import annotations

import numpy as np
import pytest

from dermis import Human
from dermis.base.arrays import Doubles
from dermis.human.cheeks import cheek_bulges
from dermis.human.expressions import expression
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose


@pytest.fixture(scope="module")
def head() -> Head:
    return Human().head(subdivide=0)


def posed(head: Head, name: str) -> Doubles:
    """Return the control points (p, 3) in a named expression [mm]."""
    rig = head.control_rig
    pose = Pose(expression(name)).to_arrays(rig)
    return rig.pose(pose.weights.astype(np.float64), pose.matrices.astype(np.float64))


@pytest.mark.parametrize("name", ["joy", "laugh"])
def test_joy_and_laugh_bunch_the_cheeks(head: Head, name: str) -> None:
    """The apple of each cheek moves up and forward by some millimetres, on both sides alike."""
    rest, moved = posed(head, "neutral"), posed(head, name)
    shifts = []
    for side in (1.0, -1.0):
        apple = np.linalg.norm(rest[:, :2] - (side * 34.0, -27.0), axis=1) + 1e3 * (rest[:, 2] < 0.0)
        shifts.append((moved - rest)[apple.argmin()])
    for _, up, forward in shifts:
        assert 4.0 < up < 13.0 and 2.0 < forward < 7.0
    assert shifts[0][1] == pytest.approx(shifts[1][1], abs=0.5)


def test_cheeks_stay_behind_the_nasolabial_fold_and_below_the_lids(head: Head) -> None:
    """The upper lip, the nose and the lids are not displaced."""
    rest = posed(head, "neutral")
    for bulge in cheek_bulges().values():
        x, y, _ = rest[bulge.point].T
        assert np.abs(x).min() > 15.0 and y.max() < -7.0
        assert 2.0 < np.linalg.norm(bulge.delta_mm, axis=1).max() < 4.0


def test_joy_narrows_the_eyes(head: Head) -> None:
    """The lower lids rise: the openings of the eyes are at least a tenth lower than at rest."""
    rig = head.control_rig
    heights = []
    for name in ("neutral", "joy"):
        edges = rig.lid_edges_mm(Pose(expression(name)).to_arrays(rig))
        heights.append(np.ptp(edges[..., 1], axis=1))
    assert (heights[1] < 0.9 * heights[0]).all() and (heights[1] > 0.3 * heights[0]).all()
