"""Heads of files that do not look along the usual axis are turned to the viewer, with a note."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from eyed_head import EYE_MM, write_head
from small_figure import write_obj
from vrm_file import VrmFile

from dermis.formats.axes import Axes, Axis, head_axis_in_file, to_y_up
from dermis.formats.load import RiggedMesh, load_rigged
from dermis.human.person import Human
from dermis.mesh.mesh import Mesh, build_mesh

FILES = [("y", "z"), ("y", "x"), ("y", "-z"), ("y", "-x"), ("z", "-y"), ("z", "y"), ("-y", "-z")]
AXES = pytest.mark.parametrize(("up", "front"), FILES)


@cache
def person() -> Mesh:
    mesh = Human().head(subdivide=1).mesh
    kept = np.array([one.kind == "skin" for one in mesh.materials])[mesh.material]
    return build_mesh(mesh.positions, mesh.uv, mesh.triangles[kept], np.zeros(kept.sum()), mesh.materials[:1])


def in_file(mesh: Mesh, up: Axis, front: Axis) -> Mesh:
    """Return a mesh with the axes of a file."""
    to_head = to_y_up(np.eye(3), Axes(up, front))
    return build_mesh(
        mesh.positions @ to_head.T, mesh.uv, mesh.triangles, mesh.material, mesh.materials, mesh.normals
    )


def found(rigged: RiggedMesh) -> list[str]:
    return [note for note in rigged.notes if "face" in note]


@AXES
def test_scan_is_rotated_to_face_the_viewer(tmp_path: Path, up: Axis, front: Axis) -> None:
    path = write_obj(tmp_path / "a.obj", in_file(person(), up, front))
    rigged, usual = load_rigged(path, up=up), Axes(up).front_or_default
    np.testing.assert_allclose(np.ptp(rigged.mesh.positions, axis=0), person().size_mm, rtol=1e-4)
    np.testing.assert_allclose(rigged.mesh.positions[:, 2].max(), person().positions[:, 2].max(), rtol=1e-4)
    note = f"its face looks along {front} and is turned to the viewer; --front={usual} keeps it as it is"
    assert found(rigged) == ([] if front == usual else [note])


def test_a_front_that_the_user_states_is_kept(tmp_path: Path) -> None:
    path = write_obj(tmp_path / "a.obj", in_file(person(), "y", "-z"))
    rigged = load_rigged(path, front="z")
    assert not found(rigged)
    assert rigged.mesh.positions[:, 2].min() == pytest.approx(-person().positions[:, 2].max(), rel=1e-4)


@pytest.mark.parametrize(
    ("options", "radius_mm"),
    [({}, 12), ({"names": ("a", "b"), "joints": ("Head", "LeftEye", "RightEye")}, 0)],
)
def test_eyes_are_recognised_by_group_and_bone_names(
    tmp_path: Path, options: dict, radius_mm: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    received = list[np.ndarray]()
    monkeypatch.setattr("dermis.formats.load.face_direction", lambda *arrays: received.extend(arrays))
    load_rigged(write_head(tmp_path / "a.glb", **options), unit_mm=1.0)
    far = EYE_MM + radius_mm
    np.testing.assert_allclose(received[2].max(axis=0), far, atol=0.2)
    np.testing.assert_allclose(received[2].min(axis=0), EYE_MM * [-1, 1, 1] - radius_mm, atol=0.2)


@pytest.mark.parametrize("version", [0, 1])
def test_avatar_format_defines_the_front(
    tmp_path: Path, version: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("dermis.formats.load.face_direction", lambda *_: "x")
    path = VrmFile(version).write(tmp_path / "a.vrm")
    assert not found(load_rigged(path)) and found(load_rigged(path, up="z"))


@AXES
def test_note_names_the_axis_of_the_file(up: Axis, front: Axis) -> None:
    axes = Axes(up, front)
    assert [head_axis_in_file(one, axes) for one in ("y", "z")] == [up, front]
    assert head_axis_in_file("-z", axes) == front.removeprefix("-") if "-" in front else f"-{front}"
