"""Export to USD: files of each kind, read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest
from scipy.spatial import cKDTree

pytest.importorskip("pxr")
pytest.importorskip("MaterialX")
from pxr import Sdf, Usd, UsdGeom, UsdShade, UsdSkel, UsdValidation

from dermis.apps.export.run import export_skin
from dermis.apps.export.target import get_numbers
from dermis.human.expressions import expression
from dermis.scene.heads import load_head


def surface(stage: Any, name: str = "skin") -> Any:
    path = stage.GetDefaultPrim().GetPath().AppendPath(f"materials/{name}")
    return UsdShade.Material(stage.GetPrimAtPath(path)).ComputeSurfaceSource("mtlx")[0]


@pytest.mark.parametrize("suffix", [".usda", ".usdc", ".usd", ".usdz"])
def test_skin_is_exported_on_a_ball(suffix: str, tmp_path: Path) -> None:
    file = tmp_path / f"ball{suffix}"
    report = export_skin("skin1", "usd", file)
    stage = Usd.Stage.Open(str(file))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/skin1/mesh"))
    low, high = mesh.GetExtentAttr().Get()
    assert high[1] - low[1] == pytest.approx(0.1, rel=1e-3)
    shader = surface(stage)
    for name in ("subsurface_radius", "subsurface_radius_scale"):
        value = shader.GetInput(name).Get()
        exported = get_numbers(report.parameters, name)
        assert ((value,) if len(exported) == 1 else tuple(value)) == pytest.approx(exported)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a .usdz file of a dressed person with glasses."""
    file = tmp_path_factory.mktemp("usd") / "person.usdz"
    worn = {"clothing": "navy wool shirt", "glasses": "gold round"}
    export_skin("human", "usd", file, side=256, adapter="cpu", **worn)
    return file


@pytest.fixture(scope="module")
def person(package: Path) -> Any:
    return Usd.Stage.Open(str(package))


def test_person_is_exported_as_one_package(package: Path, person: Any) -> None:
    with ZipFile(package) as archive:
        names = archive.namelist()
    assert names[0].endswith(".usdc") and {".png"} == {Path(name).suffix for name in names[1:]}
    mesh = UsdGeom.Mesh(person.GetPrimAtPath("/human/mesh"))
    assert len(mesh.GetPrim().GetRelationship("skel:blendShapeTargets").GetTargets()) == 52
    children = {prim.GetName() for prim in person.GetDefaultPrim().GetChildren()}
    assert children == {"mesh", "skeleton", "materials", "hair", "lashes", "brows"}
    used = [
        attribute.Get().resolvedPath
        for prim in person.Traverse()
        for attribute in prim.GetAttributes()
        if attribute.GetTypeName() == Sdf.ValueTypeNames.Asset
    ]
    assert used and all(used)
    uv = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened())
    eye = np.repeat(material_faces(person, "left_eye"), np.array(mesh.GetFaceVertexCountsAttr().Get()))
    assert surface(person, "left_eye").GetInput("base_color").HasConnectedSource()
    middle = np.hypot(*(uv[eye] - 0.5).T)  # of the picture, which shows the iris
    assert middle.min() < 0.05 and 0.48 < middle.max() < 0.5


def test_subsets_have_the_names_of_parts(person: Any) -> None:
    subsets = UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Mesh(person.GetPrimAtPath("/human/mesh")))
    names = {subset.GetPrim().GetName() for subset in subsets}
    assert {"skin", "eye_left", "eye_right", "teeth_upper", "teeth_lower", "tongue"} <= names
    assert {"cloth", "button", "glasses_frame", "nose_pad"} <= names
    assert not any(name.startswith("part_") for name in names)


def test_validators_of_a_person_miss_only_nodes_of_materialx(person: Any) -> None:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    found = UsdValidation.ValidationContext(validators).Validate(person)
    assert [error.GetMessage() for error in found if "'ND_" not in error.GetMessage()] == []


def test_worn_things_have_their_materials(person: Any) -> None:
    cloth, frame = surface(person, "cloth"), surface(person, "glasses_frame")
    fuzz = cloth.GetInput("fuzz_weight").Get()
    assert 0.0 < fuzz <= 1.0 and frame.GetInput("fuzz_weight").Get() is None
    assert frame.GetInput("base_metalness").Get() == 1.0
    red, _, blue = cloth.GetInput("base_color").Get()
    assert blue > 1.5 * red  # navy
    gold = frame.GetInput("base_color").Get()
    assert gold[0] > gold[1] > gold[2]


def test_expressions_are_variants_that_move_skin_and_brows(person: Any) -> None:
    variants = person.GetDefaultPrim().GetVariantSets().GetVariantSet("expression")
    assert {"neutral", "joy", "surprise", "smile_with_teeth"} <= set(variants.GetVariantNames())
    assert variants.GetVariantSelection() == "neutral"
    targets = load_head("human", subdivide=0).control_rig.targets
    rest = np.zeros(len(targets.names)) if targets.rest is None else targets.rest
    moved = {}
    for name in ("neutral", "surprise"):
        stage = Usd.Stage.Open(person.GetRootLayer(), Sdf.Layer.CreateAnonymous())
        stage.SetEditTarget(stage.GetSessionLayer())
        stage.GetDefaultPrim().GetVariantSets().GetVariantSet("expression").SetVariantSelection(name)
        animation = UsdSkel.Animation(stage.GetPrimAtPath("/human/skeleton/rest"))
        expected = dict(zip(targets.names, rest, strict=True)) | (
            expression(name) if name != "neutral" else {}
        )
        assert list(animation.GetBlendShapesAttr().Get()) == list(expected)
        np.testing.assert_allclose(
            animation.GetBlendShapeWeightsAttr().Get(), list(expected.values()), atol=1e-6
        )
        UsdSkel.BakeSkinning(Usd.PrimRange(stage.GetDefaultPrim()))
        prims = (
            UsdGeom.PointBased(stage.GetPrimAtPath(f"/human/{one}")) for one in ("mesh", "brows", "hair")
        )
        moved[name] = [1000.0 * np.array(prim.GetPointsAttr().Get(0.0)) for prim in prims]
    skin, brows, hair = (b - a for a, b in zip(*moved.values(), strict=True))
    assert np.abs(skin).max() > 10.0 and np.abs(hair).max() < 0.01
    nearest = cKDTree(moved["neutral"][0]).query(moved["neutral"][1])[1]
    assert brows[:, 1].mean() > 2.0
    assert np.abs(brows - skin[nearest]).max() < 1.5  # the mesh has quads of about 2 mm


def material_faces(stage: Any, material: str) -> Any:
    """Return the mask of faces to which a material is bound."""
    counts = UsdGeom.Mesh(stage.GetPrimAtPath("/human/mesh")).GetFaceVertexCountsAttr().Get()
    found = np.zeros(len(counts), bool)
    for subset in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Mesh(stage.GetPrimAtPath("/human/mesh"))):
        bound = UsdShade.MaterialBindingAPI(subset.GetPrim()).GetDirectBinding().GetMaterialPath()
        if bound.name == material:
            found[list(subset.GetIndicesAttr().Get())] = True
    return found
