"""A head as a USD stage, in metres, Y up."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from dermis.apps.export.targets.openpbr.materials import Look, hair_look
from dermis.apps.export.targets.usd.geometry import TASK, add_hairs, add_mesh
from dermis.apps.export.targets.usd.materials import add_material
from dermis.apps.export.targets.usd.motion import add_motion, valid_names
from dermis.base.extras import needed
from dermis.formats.moved_points import MovedPoints
from dermis.mesh.head import Head


def stage_of(head: Head, name: str, looks: Mapping[int, Look], prefix: str) -> Any:
    """The stage.

    name : what the head is called
    looks : by the mesh's materials
    prefix : of the maps' names, which lie beside the stage
    """
    usd, geometry, sdf = (needed(f"pxr.{one}", TASK) for one in ("Usd", "UsdGeom", "Sdf"))
    stage = usd.Stage.CreateInMemory()
    geometry.SetStageMetersPerUnit(stage, 1.0)
    geometry.SetStageUpAxis(stage, geometry.Tokens.y)
    root = sdf.Path("/" + valid_names([name])[0])
    moved = MovedPoints(head)
    top = _root(stage, root, moved)
    top.SetDisplayName(name)
    usd.ModelAPI(top).SetKind("component")
    stage.SetDefaultPrim(top)
    if head.attribution:
        stage.GetRootLayer().customLayerData = {"attribution": head.attribution}
    path = root.AppendChild("mesh")
    subsets = add_mesh(stage, path, head, moved)
    if moves(moved):
        add_motion(stage, root, stage.GetPrimAtPath(path), moved)
    _add_materials(stage, root.AppendChild("materials"), subsets, looks, prefix)
    _add_hairs(stage, root, head)
    return stage


def moves(moved: MovedPoints) -> bool:
    """Whether anything moves the head."""
    return bool(moved.rig.targets.names) or moved.rig.skeleton is not None


def _root(stage: Any, path: Any, moved: MovedPoints) -> Any:
    geometry, skel = needed("pxr.UsdGeom", TASK), needed("pxr.UsdSkel", TASK)
    kind = skel.Root if moves(moved) else geometry.Xform
    return kind.Define(stage, path).GetPrim()


def _add_materials(stage: Any, scope: Any, subsets: Mapping[int, Any], looks: Any, prefix: str) -> None:
    geometry, shade = needed("pxr.UsdGeom", TASK), needed("pxr.UsdShade", TASK)
    geometry.Scope.Define(stage, scope)
    names = valid_names([looks[kind].name for kind in subsets])
    for (kind, subset), name in zip(subsets.items(), names, strict=True):
        material = add_material(stage, scope.AppendChild(name), looks[kind], prefix)
        shade.MaterialBindingAPI.Apply(subset.GetPrim()).Bind(material)


def _add_hairs(stage: Any, root: Any, head: Head) -> None:
    shade = needed("pxr.UsdShade", TASK)
    for name, strands in (("lashes_and_brows", head.strands), ("hair", head.hair)):
        if strands is None:
            continue
        made = add_hairs(stage, root.AppendChild(name), head, strands)
        look = hair_look(strands.absorption, float(np.median(strands.radius_mm)))
        material = add_material(stage, root.AppendPath(f"materials/{name}"), look, "")
        shade.MaterialBindingAPI.Apply(made.GetPrim()).Bind(material)
