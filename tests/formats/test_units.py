"""The unit of a file comes from its format, from the user or from its size, and is never guessed silently."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from small_figure import arm, ellipsoids, figure, patch

from dermis.base.errors import DermisError
from dermis.formats.load import RiggedMesh
from dermis.formats.units import guess_unit_mm, with_positions_in_mm
from dermis.mesh.mesh import Mesh, build_mesh
from dermis.mesh.primitives import uv_sphere

HEAD = ellipsoids(((0, 0, 0), (80, 120, 100)))
HAND = ellipsoids(((0, 0, 0), (45, 95, 20)))
FINGER = ellipsoids(((0, 0, 0), (9, 40, 9)))


def scaled(mesh: Mesh, factor: float) -> Mesh:
    return build_mesh(mesh.positions * factor, mesh.uv, mesh.triangles, mesh.material, mesh.materials)


def settled(mesh: Mesh, name: str, unit_mm: float | None = None) -> RiggedMesh:
    return with_positions_in_mm(RiggedMesh(mesh, None), Path(name), unit_mm, name)


def refusal(mesh: Mesh, name: str, unit_mm: float | None = None) -> str:
    with pytest.raises(DermisError) as caught:
        settled(mesh, name, unit_mm)
    return str(caught.value)


@pytest.mark.parametrize("unit_mm", [1, 10, 25.4, 100, 1000])
@pytest.mark.parametrize(("mesh", "height"), [(figure(), 1700), (HEAD, 240)], ids=["figure", "head"])
def test_unit_of_figures_and_heads_is_guessed(mesh: Mesh, height: float, unit_mm: float) -> None:
    found = settled(scaled(mesh, 1 / unit_mm), "skin.obj")
    assert found.mesh.size_mm[1] == pytest.approx(height, rel=1e-3)


@pytest.mark.parametrize("unit_mm", [1, 10, 100, 1000])
@pytest.mark.parametrize("mesh", [HAND, FINGER, arm(), patch()], ids=["hand", "finger", "arm", "patch"])
def test_unit_of_skin_patches_is_guessed(mesh: Mesh, unit_mm: float) -> None:
    assert guess_unit_mm(mesh.positions / np.float32(unit_mm), mesh.triangles) == unit_mm


def test_guessed_unit_is_noted_with_the_resulting_size() -> None:
    (note,) = settled(scaled(figure(), 0.01), "body.ply").notes
    assert note == "its unit is not stated; 1 unit = 100 mm makes it 1.7 m high; --unit-mm sets another"
    (note,) = settled(scaled(figure(), 0.1), "body.obj").notes  # not a doll of 170 mm
    assert "1 unit = 10 mm makes it 1.7 m high" in note
    (note,) = settled(patch(), "patch.obj").notes
    assert "1 unit = 1 mm makes it 60 mm" in note


def test_a_hand_or_head_of_some_hundred_units_is_in_mm_without_a_note() -> None:
    for mesh in (HEAD, HAND, arm()):
        assert settled(mesh, "skin.obj").notes == ()


def test_a_stated_unit_is_not_replaced_by_a_guess() -> None:
    assert settled(scaled(HAND, 0.1), "hand.obj", 1.0).mesh.size_mm[1] == pytest.approx(19.0, rel=1e-3)
    patch_in_metres = settled(patch(), "patch.glb")
    assert patch_in_metres.mesh.size_mm[0] == pytest.approx(60.0) and not patch_in_metres.notes


def test_a_head_of_metres_has_a_note() -> None:
    (note,) = settled(scaled(HEAD, 10), "head.glb").notes
    assert note == "it is 2.4 m high at 1000 mm per unit; --unit-mm sets another"
    assert not settled(figure(), "body.glb").notes


@pytest.mark.parametrize(
    ("mesh", "advice"),
    [
        (scaled(figure(), 100), "--unit-mm: 10, for a program that writes centimetres, makes it 1.7 m high"),
        (scaled(HEAD, 1000), "--unit-mm: 1, for a program that writes millimetres, makes it 240 mm high"),
        (scaled(figure(), 1000), "--unit-mm: 1, for a program that writes millimetres, makes it 1.7 m high"),
    ],
)
def test_refusal_of_metres_names_the_fitting_unit(mesh: Mesh, advice: str) -> None:
    message = refusal(mesh, "skin.glb")
    assert "forgotten unit?" in message and "at 1000 mm per unit" in message and advice in message


def test_units_that_give_an_unusual_size_are_not_suggested() -> None:
    assert refusal(scaled(HEAD, 34), "scan.glb").endswith("with --unit-mm.")  # 8.2 m, or 82 mm in cm
    assert refusal(uv_sphere(0.1, 12, 6), "scan.obj", 1.0).endswith("with --unit-mm.")
