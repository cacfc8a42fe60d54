"""USD stages of a head: points, rig, and checks by the USD and MaterialX libraries."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigged_head import write_rigged_head

pytest.importorskip("pxr")
pytest.importorskip("MaterialX")
from pxr import Gf, Sdf, Usd, UsdGeom, UsdSkel, UsdValidation

from dermis.apps.export.targets.openpbr.document import standard_library
from dermis.apps.export.targets.openpbr.materials import OpenPbrMaterial, skin_material
from dermis.apps.export.targets.usd.geometry import unique_usd_names
from dermis.apps.export.targets.usd.stage import build_stage
from dermis.formats.deformable_mesh import DeformableMesh
from dermis.human.person import Human
from dermis.mesh.head import Head
from dermis.mesh.pose import Pose
from dermis.scene.heads import load_head
from dermis.scene.skin import Skin

HOSTILE = '"; import os\n)</x>@#usda {'
SINGLE_MM = 1e-3  # error of positions that are stored in metres in single precision


@pytest.fixture(scope="module")
def rigged(tmp_path_factory: pytest.TempPathFactory) -> Head:
    return load_head(write_rigged_head(tmp_path_factory.mktemp("usd") / "face.glb"), subdivide=0)


def mesh_materials(head: Head, name: str = "skin") -> Mapping[int, OpenPbrMaterial]:
    material = skin_material(
        name, Skin(), (1e-3, 4e-4, 2e-4), (0.4, 0.2, 0.1), ["colour", "roughness", "normal"]
    )
    return dict.fromkeys(range(len(head.mesh.materials)), material)


def write_stage(head: Head, path: Path, name: str = "head") -> Any:
    stage = build_stage(head, name, mesh_materials(head, name), "a_")
    stage.GetRootLayer().Export(str(path))
    return Usd.Stage.Open(str(path))


def test_points_read_back_in_metres(rigged: Head, tmp_path: Path) -> None:
    stage = write_stage(rigged, tmp_path / "head.usdc")
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0 and UsdGeom.GetStageUpAxis(stage) == "Y"
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/head/mesh"))
    points = np.array(mesh.GetPointsAttr().Get())
    mine = np.zeros_like(points)
    mine[rigged.mesh.point] = rigged.mesh.positions
    np.testing.assert_allclose(1000.0 * points, mine, atol=SINGLE_MM)
    uv = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened()
    corner = np.array(mesh.GetFaceVertexIndicesAttr().Get())
    assert len(uv) == len(corner) == sum(mesh.GetFaceVertexCountsAttr().Get())
    mine_uv = rigged.mesh.uv * [1.0, -1.0] + [0.0, 1.0]
    assert point_uv_set(corner, uv) == point_uv_set(rigged.mesh.point, mine_uv)


def point_uv_set(points: Any, uv: Any) -> set[tuple[float, ...]]:
    """Return the set of points with their texture coordinates."""
    return set(map(tuple, np.round(np.column_stack([points, np.array(uv)]), 5).tolist()))


def test_quads_are_restored() -> None:
    head = Human().head(subdivide=1)
    stage = build_stage(head, "head", mesh_materials(head), "a_")
    counts = np.array(UsdGeom.Mesh(stage.GetPrimAtPath("/head/mesh")).GetFaceVertexCountsAttr().Get())
    assert (counts == 4).sum() == len(head.mesh.quads) and counts.sum() == 4 * len(head.mesh.quads)
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/head/mesh"))
    points = 1000.0 * np.array(mesh.GetPointsAttr().Get())
    corners = points[np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 4)]
    first, second = head.mesh.triangles[head.mesh.quads].transpose(1, 0, 2)
    expected = DeformableMesh(head).positions_mm[np.column_stack([first, second[:, 1]])]
    np.testing.assert_allclose(corners, expected, atol=SINGLE_MM)


def test_targets_and_bones_deform_as_in_the_package(rigged: Head, tmp_path: Path) -> None:
    stage = write_stage(rigged, tmp_path / "head.usda")
    rest = UsdSkel.Animation(stage.GetPrimAtPath("/head/skeleton/rest"))
    names = list(rest.GetBlendShapesAttr().Get())
    weights = {"jawOpen": 0.7, "browInnerUp": 0.4}
    rest.GetBlendShapeWeightsAttr().Set([weights.get(name, 0.0) for name in names])
    transforms = list(rest.GetTransforms())
    joints = list(rest.GetJointsAttr().Get())
    turn = Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(0, 1, 0), 25.0))
    number = joints.index("neck/head")
    transforms[number] = turn * transforms[number]
    rest.SetTransforms(transforms)
    UsdSkel.BakeSkinning(Usd.PrimRange(stage.GetPrimAtPath("/head")))
    deformed = np.array(UsdGeom.Mesh(stage.GetPrimAtPath("/head/mesh")).GetPointsAttr().Get(0.0))
    pose = Pose(weights=weights, bones={"head": (0.0, 25.0, 0.0)})
    expected = rigged.control_rig.posed_points_mm(pose.to_arrays(rigged.control_rig))
    assert np.abs(expected - rigged.control_rig.posed_points_mm(rigged.control_rig.rest)).max() > 10.0
    np.testing.assert_allclose(1000.0 * deformed, expected, atol=10 * SINGLE_MM)


def test_validators_find_nothing(rigged: Head, tmp_path: Path) -> None:
    for role in ("colour", "roughness", "normal"):
        (tmp_path / f"a_{role}.png").write_bytes(b"")
    stage = write_stage(rigged, tmp_path / "head.usda", HOSTILE)
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    # usd-core comes without MaterialX's plug-in, so that it knows none of its nodes: the next test does.
    assert {error.GetName() for error in found} == {"MissingShaderIdInRegistry"}
    assert all("'ND_" in error.GetMessage() for error in found)


def test_nodes_are_defined_by_materialx(rigged: Head, tmp_path: Path) -> None:
    stage = write_stage(rigged, tmp_path / "head.usda")
    types = {"color3f": "color3", "float2": "vector2", "float3": "vector3", "asset": "filename"}
    kinds = set()
    for prim in stage.Traverse():
        kind = prim.GetAttribute("info:id").Get() if prim.GetTypeName() == "Shader" else None
        if kind is None or not kind.startswith("ND_"):
            continue
        kinds.add(kind)
        node = standard_library().getNodeDef(kind)
        for attribute in prim.GetAttributes():
            name = attribute.GetName()
            if name.startswith("inputs:"):
                known = node.getActiveInput(name.removeprefix("inputs:"))
                assert known is not None, (kind, name)
                usd_type = str(attribute.GetTypeName())
                assert types.get(usd_type, usd_type) == known.getType(), (kind, name)
    assert {"ND_open_pbr_surface_surfaceshader", "ND_image_color3", "ND_normalmap_float"} <= kinds


def test_hostile_names_become_valid_prim_names(rigged: Head, tmp_path: Path) -> None:
    stage = write_stage(rigged, tmp_path / "head.usda", HOSTILE)
    top = stage.GetDefaultPrim()
    assert top.GetDisplayName() == HOSTILE and Sdf.Path.IsValidIdentifier(top.GetName())
    assert [prim.GetName() for prim in top.GetChildren()] == ["mesh", "skeleton", "materials"]


def test_equal_names_are_made_unique() -> None:
    assert unique_usd_names(["a b", "a_b", "a-b"]) == ["a_b", "a_b_again1", "a_b_again2"]
