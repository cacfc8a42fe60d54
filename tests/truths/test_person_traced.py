"""Path-traced person: cache keys of everything in the picture, pose, eyes and hair."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from painted_ball import ball, paint
from painted_ball import scene as ball_scene

from dermis.apps.truths.path_traced import PathTraced
from dermis.apps.truths.person import medium
from dermis.apps.truths.person.path_traced import path_trace_person, person_cache_key
from dermis.apps.truths.person.person import posed_person
from dermis.base.errors import DermisError
from dermis.human.hair.look import HairLook
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.scene.camera import portrait
from dermis.scene.lights import RectangleLight
from dermis.scene.model import Scene

pytest.importorskip("mitsuba")
MEDIUM = medium.uniform_skin((0.5, 0.3, 0.2), (0.2, 0.1, 0.1), 1.0)
LIGHT = RectangleLight(position=(-300.0, 300.0, 900.0))


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(medium, "ALBEDO_GRID_SIDE_VOXELS", 8)


@cache
def head() -> Head:
    return Human(hair=HairLook("cropped")).head(hairs=0.2)


def scene(**given: Any) -> Scene:
    return Scene(head(), lights=(LIGHT,), camera=portrait(head()), **given)


def traced(samples: int, **painted: Any) -> PathTraced:
    return path_trace_person(scene(), paint(**painted), MEDIUM, (24, 24), samples)


def test_more_samples_are_added_to_cached_ones() -> None:
    first, more = traced(8), traced(12)
    assert (first.samples, more.samples) == (8, 12)
    assert more.seconds > first.seconds > 0.0
    difference = (12 * more.image.astype(float) - 8 * first.image) / 4  # mean of the four added samples
    assert difference.min() > -1e-3
    covered = more.mask > 0.999
    assert 0.2 < covered.mean() < 0.8 and np.isfinite(more.image).all()
    assert 0.01 < more.image[covered].mean() < 1.0 and more.variance[covered].mean() > 0.0
    assert np.median(more.image[more.mask == 0.0]) == 0.0


def test_cache_keys_depend_on_all_inputs() -> None:
    person, path = posed_person(scene(), paint()), MEDIUM
    brows, *others = person.hairs
    thicker = replace(person, hairs=(replace(brows, radius_mm=2 * brows.radius_mm), *others))
    others = [
        person_cache_key(scene(), person, path, "form"),
        person_cache_key(scene(), person, MEDIUM.with_eta(1.4), "form"),
        person_cache_key(scene(), person, None, "form"),
        person_cache_key(scene(), replace(person, textures=paint(strength=0.5)), path, "form"),
        person_cache_key(scene(), person, path, "another"),
        person_cache_key(scene(), thicker, path, "form"),
        person_cache_key(scene(), replace(person, eyes=2 * person.eyes), path, "form"),
        person_cache_key(scene(), replace(person, textures=paint(colour=(0.4, 0.3, 0.2))), path, "form"),
        person_cache_key(replace(scene(), lights=()), person, path, "form"),
    ]
    assert len(set(others)) == len(others)
    assert others[0] == person_cache_key(scene(), posed_person(scene(), paint()), path, "form")


def test_a_pose_moves_skin_eyes_and_hairs() -> None:
    rest = posed_person(scene(), paint())
    posed = posed_person(scene(pose={"jawOpen": 1.0, "eyeLookUpLeft": 1.0, "browInnerUp": 1.0}), paint())
    moved = np.linalg.norm(posed.mesh.positions - rest.mesh.positions, axis=1)
    assert 10.0 < moved.max() < 60.0 and np.median(moved) < 0.5
    assert np.abs(posed.eyes[0, :3, :3] - rest.eyes[0, :3, :3]).max() > 0.1
    np.testing.assert_allclose(posed.eyes[1], rest.eyes[1], atol=1e-6)
    assert len(posed.hairs) == len(rest.hairs) == 2  # brows with lashes, and scalp hair
    assert 1.0 < np.linalg.norm(posed.hairs[0].knots_mm - rest.hairs[0].knots_mm, axis=-1).max() < 20.0


def test_eyes_look_out_of_the_head() -> None:
    person = posed_person(scene(), paint())
    back = np.linalg.inv(person.eyes)
    balls = person.mesh.material[:, None] == np.array(person.eye_materials)
    for k, matrix in enumerate(back):
        middle = person.mesh.positions[np.unique(person.mesh.triangles[balls[:, k]])].mean(axis=0)
        assert np.linalg.norm(matrix[:3, 3] - middle) < 2.0
        assert matrix[2, 2] > 0.9 * np.cbrt(np.linalg.det(matrix[:3, :3]))


def test_heads_without_true_eyes_are_refused() -> None:
    with pytest.raises(DermisError, match="eyes of true shape"):
        path_trace_person(ball_scene(), ball().textures, MEDIUM, (8, 8), 4)
