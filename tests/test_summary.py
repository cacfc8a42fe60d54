"""Printed summaries of heads and other large data."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

import dermis
from dermis.base.summary import short_repr
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere


@pytest.fixture(scope="module")
def person() -> Head:
    return Human().head(subdivide=0)


def test_head_summary_has_name_size_maps_and_rig(person: Head) -> None:
    first, second = repr(person).splitlines()
    assert first == f"<Head 'human': {len(person.mesh.triangles):,} triangles at level 0 of subdivision"
    assert second.split("; ")[:3] == [" maps: painted", "52 targets", "10 bones"]
    ball = Head("ball", uv_sphere(120.0), Maps(colour=np.zeros((512, 512, 3), np.float32)))
    assert repr(ball).splitlines()[1] == " maps: colour>"


def test_summaries_omit_arrays(person: Head) -> None:
    pose = dermis.Pose({f"target {k}": 1.0 for k in range(99)}, positions_mm=person.positions_mm)
    rig = person.control_rig
    parts = [getattr(person, one.name) for one in fields(person)]
    for thing in (person, pose, rig, rig.targets, rig.skeleton, rig.contact, rig.outline, *parts):
        assert len(repr(thing)) < 500
    assert "int32" in repr(person.mesh)
    assert "float32[" in repr(pose)


def test_short_values_are_printed_unchanged() -> None:
    assert short_repr((1, 2)) == "(1, 2)"
    assert short_repr("a name") == "'a name'"
    assert short_repr(list(range(1000))) == "<1,000 in a list>"
    assert short_repr(np.zeros((3, 2))) == "float64[3, 2]"
    assert short_repr((np.zeros(9),)) == "<1 in a tuple>"
