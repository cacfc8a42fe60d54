"""Heads with what they wear: meshes, rig and materials are appended to those of the bare head."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints
from dermis.human.makehuman import makehuman_arrays
from dermis.human.model import Layout, head_template
from dermis.human.movement import expression_targets
from dermis.human.wear.fabrics import CLOTHS, linear_colour
from dermis.human.wear.garments import garment_panels
from dermis.human.wear.look import Clothing
from dermis.human.wear.panels import Panel
from dermis.human.wear.skin_sheet import skin_sheet, unit_vectors
from dermis.mesh.fabric import MM_PER_UV
from dermis.mesh.head import Head
from dermis.mesh.mesh import Material, build_mesh
from dermis.mesh.rig import BONES_PER_POINT, MorphTargets, Rig, Stencils

_MIN_DELTA_MM = 0.02  # smaller displacements of cloth by expressions are left out
_CLOTHING_LABEL = "clothing"
_BUTTON_COLOUR, _BUTTON_ROUGHNESS = (0.62, 0.6, 0.54), 0.35
_CORD_COLOUR = (0.72, 0.71, 0.68)


class Worn(NamedTuple):
    """Surfaces that are worn, as one mesh that is the same for all people but for positions.

    point : (v,) index of the point of each vertex
    uv : (v, 2) texture coordinates
    triangles : (t, 3) vertices
    material : (t,) index into the materials that are worn
    bone, weight : (m, 4) bones that move each of the m points, and their weights
    target, target_point, delta_mm : (n,) index of the expression, (n,) index of the point and (n, 3)
        displacement of the points by expressions [mm]
    """

    point: Ints
    uv: Floats
    triangles: Ints
    material: Ints
    bone: Ints
    weight: Floats
    target: Index
    target_point: Index
    delta_mm: Floats

    @property
    def point_count(self) -> int:
        """Return the number of points."""
        return len(self.bone)


def garment_points_mm(control_mm: Floats, clothing: Clothing) -> Doubles:
    """Return the points (m, 3) of a garment on a person [mm].

    control_mm : (p, 3) control points of the person at rest
    """
    skin_mm, normals = skin_sheet().fit(control_mm.astype(np.float64))
    cover, placed = np.zeros(len(skin_mm)), list[Doubles]()
    for panel in _panels(clothing.garment, clothing.cloth):
        points = panel.place(skin_mm, normals, cover)
        placed.append(points)
        if panel.covers:
            cover = np.maximum(cover, panel.heights_on_sheet(points, skin_mm, normals))
    return np.concatenate(placed)


def dress(head: Head, clothing: Clothing, template: Head | None) -> Head:
    """Return a head with clothing.

    template : the dressed head of the mean person, whose atlas and other data are shared; None to make it
    """
    worn = worn_garment(clothing.garment, clothing.cloth)
    rig = _dressed_rig(head, worn, garment_points_mm(head.control_rig.positions_mm, clothing))
    rig = replace(rig, template=template and template.control_rig)
    mesh, first_point = head.mesh, int(head.mesh.point.max()) + 1
    points = rig.positions_mm[-worn.point_count :]
    triangles = np.concatenate([mesh.triangles, worn.triangles + len(mesh.positions)])
    dressed = build_mesh(
        np.concatenate([mesh.positions, points[worn.point]]),
        np.concatenate([mesh.uv, worn.uv]),
        triangles,
        np.concatenate([mesh.material, worn.material + len(mesh.materials)]),
        (*mesh.materials, *garment_materials(clothing)),
        point=np.concatenate([mesh.point, worn.point + first_point]),
        quads=mesh.quads,
    )
    return replace(head, mesh=dressed, rig=rig, template=template, undressed=head)


def dressed_template(layout: Layout, levels: int, clothing: Clothing) -> Head:
    """Return the dressed head of the mean person, which all people with this garment share; it is cached."""
    return _dressed_template(layout, levels, clothing.garment, clothing.cloth)


@cache
def _dressed_template(layout: Layout, levels: int, garment: str, cloth: str) -> Head:
    return dress(head_template(layout, levels).head, Clothing(garment, cloth), None)


def garment_materials(clothing: Clothing) -> tuple[Material, ...]:
    """Return the materials of a garment, one for each slot of `_slots`."""
    cloth, colour = CLOTHS[clothing.cloth], linear_colour(clothing.colour)
    of_slot = {
        "cloth": Material("cloth", "opaque", colour, roughness=cloth.roughness, fabric=cloth.fabric),
        "trim": Material("trim", "opaque", colour, roughness=cloth.roughness, fabric=cloth.trim),
        "button": Material("button", "opaque", _BUTTON_COLOUR, roughness=_BUTTON_ROUGHNESS),
        "cord": Material("cord", "opaque", _CORD_COLOUR, roughness=0.8, fabric=CLOTHS["cotton"].fabric),
    }
    slots = _slots(clothing.garment, clothing.cloth)
    return tuple(replace(of_slot[slot], label=_CLOTHING_LABEL) for slot in slots)


def _panels(garment: str, cloth: str) -> Sequence[Panel]:
    return garment_panels(garment, CLOTHS[cloth].folds)


def _slots(garment: str, cloth: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(panel.slot for panel in _panels(garment, cloth)))


@cache
def worn_garment(garment: str, cloth: str) -> Worn:
    """Return the mesh of a garment, its bone weights and its displacements by expressions."""
    from scipy.sparse import vstack

    panels, slots = _panels(garment, cloth), _slots(garment, cloth)
    counts = np.cumsum([0, *(len(panel.height_mm) for panel in panels)])
    seams = [panel.vertices for panel in panels]
    first_vertex = np.cumsum([0, *(len(one.point) for one in seams)])
    bind = (vstack([panel.bind for panel in panels]) @ skin_sheet().weights).tocsr()
    bone, weight = _bone_weights(bind)
    target, point, delta = _displacements(bind)
    return Worn(
        np.concatenate([one.point + first for one, first in zip(seams, counts, strict=False)]),
        np.concatenate([one.uv_mm for one in seams]).astype(np.float32) / np.float32(MM_PER_UV),
        np.concatenate([one.triangles + first for one, first in zip(seams, first_vertex, strict=False)]),
        np.repeat([slots.index(panel.slot) for panel in panels], [len(one.triangles) for one in seams]),
        bone,
        weight,
        target,
        point,
        delta,
    )


def _bone_weights(bind) -> tuple[Ints, Floats]:
    """Return the four strongest bones (m, 4) of points, and their weights (m, 4).

    bind : (m, p) weights of MakeHuman's points in each of the m points
    """
    arrays = makehuman_arrays()
    own = arrays["weight"][: bind.shape[1]].astype(np.float64)
    dense = np.zeros((len(own), len(arrays["bone_names"])))
    np.add.at(dense, (np.arange(len(own))[:, None], arrays["bone"][: len(own)]), own)
    spread = np.asarray(bind @ (dense / dense.sum(axis=1, keepdims=True)))
    bone = np.argsort(-spread, axis=1, kind="stable")[:, :BONES_PER_POINT]
    weight = np.take_along_axis(spread, bone, 1)
    return bone.astype(np.int32), (weight / weight.sum(axis=1, keepdims=True)).astype(np.float32)


def _displacements(bind) -> tuple[Index, Index, Floats]:
    """Return target, point and displacement of points by expressions; see `Worn` for the arrays."""
    targets, count = expression_targets(), bind.shape[1]
    found: list[tuple[Index, Index, Doubles]] = []
    for k in range(len(targets.names)):
        part = targets.displacement_rows(k)
        inside = targets.point[part] < count
        dense = np.zeros((count, 3))
        dense[targets.point[part][inside]] = targets.delta_mm[part][inside]
        moved = np.asarray(bind @ dense)
        rows = np.flatnonzero(np.abs(moved).max(axis=1) > _MIN_DELTA_MM)
        found.append((np.full(len(rows), k), rows, moved[rows]))
    target, point, delta = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return target, point, delta.astype(np.float32)


def _dressed_rig(head: Head, worn: Worn, points_mm: Doubles) -> Rig:
    rig = head.control_rig
    assert rig.skeleton is not None
    skeleton = replace(
        rig.skeleton,
        bone=np.concatenate([rig.skeleton.bone, worn.bone]),
        weight=np.concatenate([rig.skeleton.weight, worn.weight]),
    )
    control = len(rig.positions_mm)
    stencils = None if rig.stencils is None else _with_single_points(rig.stencils, control, worn.point_count)
    return replace(
        rig,
        positions_mm=np.concatenate([rig.positions_mm, points_mm.astype(np.float32)]),
        targets=_with_displacements(rig.targets, worn, control),
        skeleton=skeleton,
        stencils=stencils,
    )


def _with_displacements(targets: MorphTargets, worn: Worn, first_point: int) -> MorphTargets:
    """Return morph targets that also move what is worn, whose points begin at `first_point`."""
    own = np.repeat(np.arange(len(targets.names)), np.diff(targets.first))
    target = np.concatenate([own, worn.target])
    order = np.argsort(target, kind="stable")
    point = np.concatenate([targets.point, worn.target_point + first_point]).astype(np.int32)
    delta = np.concatenate([targets.delta_mm, worn.delta_mm])
    first = np.concatenate([[0], np.cumsum(np.bincount(target, minlength=len(targets.names)))])
    return replace(targets, first=first.astype(np.int32), point=point[order], delta_mm=delta[order])


def _with_single_points(stencils: Stencils, first_point: int, count: int) -> Stencils:
    """Return stencils with `count` more points, each of which is one control point, from `first_point` on."""
    end = int(stencils.first[-1])
    return Stencils(
        np.concatenate([stencils.first, end + 1 + np.arange(count)]).astype(np.int32),
        np.concatenate([stencils.point, first_point + np.arange(count)]).astype(np.int32),
        np.concatenate([stencils.weight, np.ones(count, np.float32)]),
    )
