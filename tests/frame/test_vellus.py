"""Vellus hair: brighter outlines against the light, and no change of skin that faces the camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from dermis import Camera, Human, Renderer, Scene
from dermis.frame.features.surface.record import vellus_per_mm
from dermis.human.hair.look import HairLook
from dermis.mesh.maps import Maps
from dermis.scene.lights import DirectionalLight

Floats = NDArray[np.float32]
SIDE = 64


@pytest.fixture(scope="module")
def profiles() -> tuple[Floats, Floats]:
    """Return a forehead from the side, lit from behind, without and with vellus hair."""
    person, renderer, found = Human(hair=HairLook()), Renderer(), []
    for vellus in (0.0, 1.0):
        head = replace(person, skin=replace(person.look, vellus=vellus)).head()
        assert vellus_per_mm(head.maps) == pytest.approx(0.1 * vellus)
        _, y, z = head.frontmost_point_mm(0.0, 30.0)
        camera = Camera(position=(600.0, y, z - 2.0), target=(0.0, y, z - 2.0), frame_mm=12.0)
        lights = (DirectionalLight(direction=(-1.0, 0.0, 0.35)),)
        scene = Scene(head, camera=camera, lights=lights)
        found.append(renderer.render(scene, size=(SIDE, SIDE), atlas=256))
    return found[0], found[1]


def test_vellus_hair_brightens_the_outline(profiles: tuple[Floats, Floats]) -> None:
    without, with_vellus = (one.mean(axis=2) for one in profiles)
    lit = without > 0.0
    changed = with_vellus[lit] / without[lit]
    assert np.quantile(changed, 0.95) > 1.1 and np.quantile(changed, 0.02) > 0.8


def test_skin_of_files_has_no_vellus_hair() -> None:
    assert vellus_per_mm(Maps(colour=np.ones((4, 4, 3), np.float32))) == 0.0


def test_skin_that_faces_the_camera_is_unchanged() -> None:
    """The path through the layer is counted from that of a ray along the normal."""
    person, renderer = Human(hair=HairLook()), Renderer()
    pictures = []
    for vellus in (0.0, 1.0):
        head = replace(person, skin=replace(person.look, vellus=vellus)).head()
        x, y, z = head.frontmost_point_mm(0.0, 30.0)
        camera = Camera(position=(x, y, z + 600.0), target=(x, y, z), frame_mm=12.0)
        pictures.append(renderer.render(Scene(head, camera=camera), size=(32, 32), atlas=256))
    assert np.median(np.abs(pictures[1] / pictures[0] - 1.0)) < 0.01
