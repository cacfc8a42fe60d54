"""Tests of MakeHuman's clothes: binding to hm08, scales, cutting at the bust, files of people and errors."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import dermis
from dermis.base.errors import DermisError, DermisWarning
from dermis.human.labels.classes import class_number
from dermis.human.labels.fields import mesh_labels
from dermis.human.makehuman import mesh_point_count
from dermis.human.person_file import read_person, write_person_json
from dermis.human.wear.base_mesh import base_mesh
from dermis.human.wear.look import FileClothing
from dermis.human.wear.mhclo import read_garment

OFFSET = 0.05  # of the points of the test garment along x, in the unit of the file [dm]
SCALE_LENGTH = 1.0  # [dm]


def near_skin_vertices() -> np.ndarray:
    """Return the vertices of hm08 that are points of the chest of the bust, from left to right."""
    mesh = base_mesh()
    points = np.asarray(mesh.weights @ dermis.Human().positions_mm[: mesh_point_count()])
    same = (mesh.offset_mm == 0.0).all(axis=1) & (mesh.weights.max(axis=1).toarray().ravel() == 1.0)
    chest = same & (points[:, 1] < -230.0) & (points[:, 2] > -60.0) & (np.abs(points[:, 0]) < 90.0)
    found = np.flatnonzero(chest)
    return found[np.argsort(points[found, 0])]


def write_garment(folder: Path, *, changed: tuple[str, str] = ("", "")) -> Path:
    """Write a garment of a row of quads over the chest, one of which is bound to a foot."""
    skin = near_skin_vertices()[:12]
    lines = ["basemesh hm08", "name bib", "obj_file bib.obj", "material bib.mhmat", "z_depth 50"]
    lines += [f"{axis}_scale {skin[0]} {skin[-1]} {SCALE_LENGTH}" for axis in "x"] + ["verts 0"]
    lines += [f"{skin[0]}"]
    lines += [f"{a} {b} {a} 0.5 0.5 0.0 {OFFSET} 0 0" for a, b in pairwise(skin)]
    lines += ["13000"]
    text = "\n".join(lines) + "\n"
    (folder / "bib.mhclo").write_text(text.replace(*changed) if changed[0] else text)
    count = len(skin) + 1
    faces = [f"f {k + 1} {k + 2} {k + 3}" for k in range(count - 2)]
    points = [f"v {k} {k * k} 0" for k in range(count)]
    (folder / "bib.obj").write_text("\n".join([*points, *faces]) + "\n")
    (folder / "bib.mhmat").write_text("name bib\ndiffuseColor 0.8 0.1 0.2\n")
    return folder / "bib.mhclo"


def test_points_follow_their_vertices_with_scaled_offsets(tmp_path: Path) -> None:
    """A point is the weighted mean of its vertices plus the offset times the scale of the person."""
    garment = read_garment(str(write_garment(tmp_path)))
    skin, mesh = near_skin_vertices()[:12], base_mesh()
    for person in (dermis.Human(), dermis.Human(weight=1.0, sex=1.0)):
        control = person.positions_mm.astype(np.float64)
        own = np.asarray(mesh.weights @ control[: mesh_point_count()])[skin]
        scale = abs(own[0, 0] - own[-1, 0]) / SCALE_LENGTH
        points = garment.points_mm(control)
        np.testing.assert_allclose(points[0], own[0], atol=1e-3)
        wanted = 0.5 * (own[:-1] + own[1:]) + np.array([OFFSET * scale, 0.0, 0.0])
        np.testing.assert_allclose(points[1:], wanted, atol=1e-3)


def test_vertices_of_the_base_mesh_are_points_of_the_bust() -> None:
    """Most points of the bust are vertices of hm08; helpers of clothes are near the skin; feet are not."""
    mesh = base_mesh()
    exact = (mesh.offset_mm == 0.0).all(axis=1)
    assert exact.sum() > 5000
    tights = mesh.is_near[15328:18002]
    assert 0.1 < tights.mean() < 0.6
    assert not mesh.is_near[13000]


def test_people_wear_garments_of_files(tmp_path: Path) -> None:
    """A head gets the garment without the part at the foot, in its colour, with its label; files keep it."""
    file = str(write_garment(tmp_path))
    person = dermis.Human(hair=dermis.HairLook("none"), clothing=file)
    head = person.head(subdivide=0, hairs=0.05)
    worn = mesh_labels(head).base[len(head.body.mesh.triangles) :]
    assert len(worn) == 10 and set(worn.tolist()) == {class_number("clothing")}
    assert head.mesh.materials[-1].colour == (0.8, 0.1, 0.2)
    turned = dermis.Pose(bones={"spine": (0, 10, 0)}).to_arrays(head.control_rig)
    moved = head.control_rig.posed_points_mm(turned)[-12:] - head.mesh.points_mm[-12:]
    assert np.linalg.norm(moved, axis=1).min() > 1.0
    write_person_json(tmp_path / "person.json", person)
    assert read_person(tmp_path / "person.json").clothing == FileClothing(file=file)


def test_changed_files_are_read_again(tmp_path: Path) -> None:
    """A garment that is written again with another offset moves."""
    file = write_garment(tmp_path)
    control = dermis.Human().positions_mm.astype(np.float64)
    before = read_garment(str(file)).points_mm(control)
    write_garment(tmp_path, changed=(f" {OFFSET} 0 0", f" {2 * OFFSET:.3f} 0 0"))
    after = read_garment(str(file)).points_mm(control)
    assert np.abs(after - before).max() > 0.5


def test_garments_that_delete_skin_leave_it_with_a_note(tmp_path: Path) -> None:
    """The list of vertices to delete is not read as a part of the garment, and a note says so."""
    file = write_garment(tmp_path, changed=("13000\n", "13000\ndelete_verts\n100 - 120\n"))
    with pytest.warns(DermisWarning, match="delete_verts is not supported"):
        garment = read_garment(str(file))
    assert len(garment.base) == 12


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (("basemesh hm08", "basemesh alpha7"), "it is for alpha7"),
        (("obj_file bib.obj", "tag shirt"), "no line obj_file"),
        (("13000", "13000 5"), "1, 6 or 9 numbers"),
        (("13000", "99999"), "vertices of hm08"),
        (("13000\n", ""), "it binds 12 of the 13 vertices"),
        (("x_scale", "shear_x"), "it has shear_x"),
    ],
)
def test_unusable_garments_are_refused(tmp_path: Path, changed: tuple[str, str], message: str) -> None:
    """Errors name the file and its fault."""
    file = write_garment(tmp_path, changed=changed)
    with pytest.raises(DermisError, match=message):
        read_garment(str(file))
    with pytest.raises(DermisError, match="missing"):
        read_garment(str(tmp_path / "missing.mhclo"))
