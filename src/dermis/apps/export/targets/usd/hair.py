"""Hairs of a head in a USD stage: curves that follow bones and, except for scalp hair, blend shapes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel, Vt

from dermis.apps.export.targets.usd.geometry import (
    METRES_PER_MM,
    add_blend_shape,
    bind_blend_shapes,
    bind_to_skeleton,
    rest_points_mm,
    to_metres,
)
from dermis.base.arrays import Doubles, Floats, Index, Numbers
from dermis.formats.deformable_mesh import DeformableMesh, VertexMorphTarget
from dermis.formats.gltf.hair_colours import hair_albedo
from dermis.mesh.strand_groups import SCALP_HAIR, moved_strands, root_vertices, sufficient_knots
from dermis.mesh.strands import Strands

_MAX_KNOT_DEVIATION_MM = 0.3
_MAX_KNOT_COUNT = 40
_MIN_DISPLACEMENT_MM = 0.05  # smaller displacements of hairs count as 0


@dataclass(frozen=True, eq=False)
class HairCurves:
    """Hairs of one group as linear curves through as few knots as their shape needs.

    name : name of the group, such as "brows"
    strands : strands of the group
    deformable : mesh of the head with its deformation
    """

    name: str
    strands: Strands
    deformable: DeformableMesh

    @cached_property
    def _knots(self) -> tuple[Doubles, Floats]:
        """Return the kept knots (n, k, 3) in the frames of their roots, and their radii (n, k) [mm]."""
        kept = sufficient_knots(self.strands, _MAX_KNOT_DEVIATION_MM, _MAX_KNOT_COUNT)
        return self.strands.knots_mm[:, kept].astype(np.float64), self.strands.radius_mm[:, kept]

    def define(self, usd_stage: Usd.Stage, curves_path: Sdf.Path) -> UsdGeom.BasisCurves:
        """Add the curves at rest to the stage, with a width at each knot and a colour for each hair."""
        offsets, radius_mm = self._knots
        mesh, count = self.deformable.head.mesh, offsets.shape[1]
        kept = Strands(
            self.strands.roots, offsets.astype(np.float32), radius_mm, self.strands.absorption
        ).knot_positions_mm(mesh, rest_points_mm(self.deformable))
        prim = UsdGeom.BasisCurves.Define(usd_stage, curves_path)
        points = Vt.Vec3fArray.FromNumpy(to_metres(kept.reshape(-1, 3)))
        widths = Vt.FloatArray.FromNumpy((2.0 * METRES_PER_MM * radius_mm.ravel()).astype(np.float32))
        prim.CreateTypeAttr(UsdGeom.Tokens.linear)
        prim.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(kept), count, np.int32)))
        prim.CreatePointsAttr(points)
        prim.CreateWidthsAttr(widths)
        prim.SetWidthsInterpolation(UsdGeom.Tokens.vertex)
        prim.CreateExtentAttr(UsdGeom.Curves.ComputeExtent(points, widths))
        colour = prim.CreateDisplayColorPrimvar(UsdGeom.Tokens.uniform)
        colour.Set(Vt.Vec3fArray.FromNumpy(hair_albedo(self.strands).astype(np.float32)))
        return prim

    def bind(self, skeleton_path: Sdf.Path, curves_prim: Usd.Prim) -> UsdSkel.BindingAPI:
        """Bind the curves to the skeleton: scalp hair to one bone, other hair like the skin at its roots."""
        bone: Numbers = np.zeros((1, 1))
        weight: Numbers = np.ones((1, 1))
        if self.deformable.rig.skeleton is not None and self.name == SCALP_HAIR:
            bone = np.full((1, 1), self.deformable.root_bone(self.strands.roots))
        elif self.deformable.rig.skeleton is not None:
            vertex = root_vertices(self.deformable.head.mesh, self.strands.roots)
            per_knot = np.repeat(vertex, self._knots[0].shape[1])
            bone, weight = (values[per_knot] for values in self.deformable.bone_influences)
        return bind_to_skeleton(skeleton_path, curves_prim, bone, weight, is_rigid=len(bone) == 1)

    def add_blend_shapes(
        self, usd_stage: Usd.Stage, binding: UsdSkel.BindingAPI, targets: Mapping[str, VertexMorphTarget]
    ) -> None:
        """Add the blend shapes that move the hairs.

        binding : binding of the curves to the skeleton
        targets : morph targets of the head by their names in the stage
        """
        if self.name == SCALP_HAIR:
            return
        names = [
            name for name, target in targets.items() if self._add_shape(usd_stage, binding, name, target)
        ]
        bind_blend_shapes(binding, names)

    def _add_shape(
        self, usd_stage: Usd.Stage, binding: UsdSkel.BindingAPI, name: str, target: VertexMorphTarget
    ) -> bool:
        knot, delta_mm = self._moved_knots(target)
        if len(knot):
            add_blend_shape(usd_stage, binding.GetPrim().GetPath().AppendChild(name), knot, delta_mm)
        return len(knot) > 0

    def _moved_knots(self, target: VertexMorphTarget) -> tuple[Index, Doubles]:
        offsets, mesh = self._knots[0], self.deformable.head.mesh
        points = rest_points_mm(self.deformable)
        delta = np.zeros_like(points)
        delta[mesh.point[target.vertex]] = target.delta_mm
        strand, moved = moved_strands(mesh, self.strands.roots, offsets, points, delta, _MIN_DISPLACEMENT_MM)
        count = offsets.shape[1]
        return (strand[:, None] * count + np.arange(count)).ravel(), moved.reshape(-1, 3)
