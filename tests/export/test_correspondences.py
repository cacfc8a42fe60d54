"""Correspondences with other face models: the landmarks are where exported files have them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dermis import Human
from dermis.apps.export.correspondences import correspondence_table
from dermis.base.errors import DermisError
from dermis.cli.correspondences import correspondences
from dermis.formats.gltf.document import Document, read_document
from dermis.formats.gltf.write import encode_head
from dermis.human.expressions import EXPRESSIONS, expression
from dermis.human.landmarks.points import landmark_points
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere


@pytest.fixture(scope="module")
def head() -> Head:
    return Human().head(subdivide=1, hairs=0.05)


@pytest.fixture(scope="module")
def table(head: Head) -> dict[str, Any]:
    return json.loads(json.dumps(correspondence_table(head)))


@pytest.fixture(scope="module")
def document(head: Head, tmp_path_factory: pytest.TempPathFactory) -> Document:
    file = tmp_path_factory.mktemp("glb") / "head.glb"
    file.write_bytes(encode_head(head, roughness=0.3, compact=True))
    return read_document(file)


def test_landmarks_are_at_vertices_of_gltf(table: dict[str, Any], document: Document) -> None:
    meshes = {mesh["name"]: mesh["primitives"][0]["attributes"] for mesh in document.tree["meshes"]}
    positions = {name: 1e3 * document.read_floats(one["POSITION"]) for name, one in meshes.items()}
    for rows in table["landmarks"].values():
        for row in rows:
            at = np.array(row["weights"]) @ positions[row["mesh"]][row["vertices"]]
            np.testing.assert_allclose(at, row["position_mm"], atol=2e-3)
    assert {row["mesh"] for rows in table["landmarks"].values() for row in rows} == {
        "head", "eye_left", "eye_right"
    }  # fmt: skip


def test_landmarks_are_at_points_of_usd(head: Head, table: dict[str, Any]) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    from dermis.apps.export.targets.usd.geometry import add_mesh
    from dermis.formats.deformable_mesh import DeformableMesh

    stage = Usd.Stage.CreateInMemory()
    add_mesh(stage, "/mesh", head, DeformableMesh(head))
    points = 1e3 * np.array(UsdGeom.Mesh(stage.GetPrimAtPath("/mesh")).GetPointsAttr().Get())
    assert len(points) == table["points"]
    for row in table["landmarks"]["mediapipe-468"]:
        at = np.array(row["weights"]) @ points[row["points"]]
        np.testing.assert_allclose(at, row["position_mm"], atol=2e-3)


def test_the_dense_set_keeps_known_points_and_is_symmetric(head: Head) -> None:
    dense, known = (landmark_points(head, name) for name in ("mediapipe-468", "mediapipe"))
    points = head.mesh.points_mm
    at, given = (np.einsum("nk,nkc->nc", one.weight, points[one.point]) for one in (dense, known))
    assert dense.names == tuple(map(str, range(468))) and len(np.unique(at.round(3), axis=0)) == 468
    for name, position in zip(known.names, given, strict=True):
        if int(name) < 468:
            np.testing.assert_allclose(at[int(name)], position, atol=1e-5)
    mirrored = np.linalg.norm(at[:, None] - at * [-1.0, 1.0, 1.0], axis=2).min(axis=1)
    assert np.percentile(mirrored, 95.0) < 1.0 and mirrored.max() < 4.0
    nose, chin, forehead = (at[number] for number in (1, 152, 10))  # as MediaPipe numbers them
    assert nose[2] == pytest.approx(at[:, 2].max(), abs=2.0)
    assert chin[1] == pytest.approx(at[:, 1].min()) and forehead[1] > at[:, 1].max() - 2.0


def test_blend_shapes_have_the_names_of_captures(table: dict[str, Any]) -> None:
    rows = {row["name"]: row for row in table["blend_shapes"]}
    assert len(rows) == 52 and {name for one in EXPRESSIONS for name in expression(one)} <= rows.keys()
    assert rows["jawOpen"]["live_link_face"] == "JawOpen" and rows["jawOpen"]["mediapipe"] == "jawOpen"
    assert [name for name, row in rows.items() if row["mediapipe"] is None] == ["tongueOut"]


def test_the_command_writes_the_table(
    table: dict[str, Any], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert correspondences("human", output=tmp_path / "a.json", head={"subdivide": 0}, as_json=True) == 0
    found = json.loads((tmp_path / "a.json").read_text("utf-8"))
    assert found.keys() == table.keys() and found["blend_shapes"] == table["blend_shapes"]
    assert json.loads(capsys.readouterr().out)["mediapipe-468"] == 468


def test_other_heads_are_refused() -> None:
    with pytest.raises(DermisError, match=r"parametric human, .* Name a person: human"):
        correspondence_table(Head("ball", uv_sphere(90.0, 8, 4), Maps()))
