"""Export to USD: files of each kind, read back."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from zipfile import ZipFile

import numpy as np
import pytest

pytest.importorskip("pxr")
pytest.importorskip("MaterialX")
from pxr import Sdf, Usd, UsdGeom, UsdShade

from dermis.apps.export.run import export_skin
from dermis.apps.export.target import get_numbers


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


def test_person_is_exported_as_one_package(tmp_path: Path) -> None:
    file = tmp_path / "person.usdz"
    export_skin("human", "usd", file, side=256, adapter="cpu")
    with ZipFile(file) as package:
        names = package.namelist()
    assert names[0].endswith(".usdc") and {".png"} == {Path(name).suffix for name in names[1:]}
    stage = Usd.Stage.Open(str(file))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/human/mesh"))
    assert len(mesh.GetPrim().GetRelationship("skel:blendShapeTargets").GetTargets()) == 52
    children = {prim.GetName() for prim in stage.GetDefaultPrim().GetChildren()}
    assert children == {"mesh", "skeleton", "materials", "hair", "lashes_and_brows"}
    used = [
        attribute.Get().resolvedPath
        for prim in stage.Traverse()
        for attribute in prim.GetAttributes()
        if attribute.GetTypeName() == Sdf.ValueTypeNames.Asset
    ]
    assert used and all(used)
    uv = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").ComputeFlattened())
    eye = np.repeat(material_faces(stage, "left_eye"), np.array(mesh.GetFaceVertexCountsAttr().Get()))
    assert surface(stage, "left_eye").GetInput("base_color").HasConnectedSource()
    middle = np.hypot(*(uv[eye] - 0.5).T)  # of the picture, which shows the iris
    assert middle.min() < 0.05 and 0.48 < middle.max() < 0.5


def material_faces(stage: Any, material: str) -> Any:
    """Return the mask of faces to which a material is bound."""
    counts = UsdGeom.Mesh(stage.GetPrimAtPath("/human/mesh")).GetFaceVertexCountsAttr().Get()
    found = np.zeros(len(counts), bool)
    for subset in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Mesh(stage.GetPrimAtPath("/human/mesh"))):
        bound = UsdShade.MaterialBindingAPI(subset.GetPrim()).GetDirectBinding().GetMaterialPath()
        if bound.name == material:
            found[list(subset.GetIndicesAttr().Get())] = True
    return found
