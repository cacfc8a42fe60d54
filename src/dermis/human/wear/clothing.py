"""Meshes of garments: points, bone weights, displacements by expressions, and materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from dermis.base.arrays import Doubles, Floats, Index, Ints, Mask
from dermis.human.makehuman import makehuman_arrays
from dermis.human.model import MEAN_PERSON_WEIGHTS, control_points_mm
from dermis.human.movement import expression_targets
from dermis.human.wear.fabrics import CLOTHS, linear_colour
from dermis.human.wear.garments import garment_panels
from dermis.human.wear.hair_obstacles import ClothObstacle
from dermis.human.wear.look import Clothing
from dermis.human.wear.panels import Panel
from dermis.human.wear.skin_sheet import NECK_AXIS_Z_MM, point_normals, skin_sheet
from dermis.human.wear.worn import Worn
from dermis.mesh.fabric import MM_PER_UV
from dermis.mesh.mesh import Material
from dermis.mesh.rig import BONES_PER_POINT

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_MIN_DELTA_MM = 0.02  # smaller displacements of cloth by expressions are left out
_MIN_OUTSIDE_COSINE = 0.2  # between normals of cloth and of the skin below, on the outside of a garment
_LABEL = "clothing"
_BUTTON_COLOUR, _BUTTON_ROUGHNESS = (0.62, 0.6, 0.54), 0.35
_CORD_COLOUR = (0.72, 0.71, 0.68)


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


def garment_obstacle(points_mm: Doubles, clothing: Clothing) -> ClothObstacle:
    """Return the outside of a garment, on which hair lies.

    points_mm : (m, 3) points of the garment on a person, from `garment_points_mm` [mm]
    """
    worn = worn_garment(clothing)
    normals = point_normals(points_mm, worn.point[worn.triangles])
    outside = garment_outside(clothing)
    body = len(_panels(clothing.garment, clothing.cloth)[0].height_mm)
    is_collar = (np.arange(len(points_mm)) >= body)[outside]
    return ClothObstacle(points_mm[outside], normals[outside], is_collar, (0.0, NECK_AXIS_Z_MM))


def garment_outside(clothing: Clothing) -> Mask:
    """Return the mask (m,) of the points of a garment whose normals point away from the skin."""
    return _outside_mask(clothing.garment, clothing.cloth)


@cache
def _outside_mask(garment: str, cloth: str) -> Mask:
    """Return the mask (m,) of the points of a garment whose normals point away from the skin."""
    clothing, sheet = Clothing(garment, cloth), skin_sheet()
    points = garment_points_mm(control_points_mm(MEAN_PERSON_WEIGHTS), clothing)
    worn, panels = worn_garment(clothing), _panels(garment, cloth)
    skin_normals = point_normals(sheet.mean_mm, sheet.triangles)
    outward = np.concatenate([panel.bind @ skin_normals for panel in panels])
    above = np.concatenate([panel.height_mm > 0.0 for panel in panels])
    facing = (point_normals(points, worn.point[worn.triangles]) * outward).sum(axis=1)
    return np.asarray(above & (facing > _MIN_OUTSIDE_COSINE))


def garment_materials(clothing: Clothing) -> tuple[Material, ...]:
    """Return the materials of a garment, in the order of the material indices of its mesh."""
    cloth, colour = CLOTHS[clothing.cloth], linear_colour(clothing.colour)
    of_slot = {
        "cloth": Material("cloth", "opaque", colour, roughness=cloth.roughness, fabric=cloth.fabric),
        "trim": Material("trim", "opaque", colour, roughness=cloth.roughness, fabric=cloth.trim),
        "button": Material("button", "opaque", _BUTTON_COLOUR, roughness=_BUTTON_ROUGHNESS),
        "cord": Material("cord", "opaque", _CORD_COLOUR, roughness=0.8, fabric=CLOTHS["cotton"].fabric),
    }
    slots = _slots(clothing.garment, clothing.cloth)
    return tuple(replace(of_slot[slot], label=_LABEL) for slot in slots)


def _panels(garment: str, cloth: str) -> Sequence[Panel]:
    return garment_panels(garment, CLOTHS[cloth].folds)


def _slots(garment: str, cloth: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(panel.slot for panel in _panels(garment, cloth)))


def worn_garment(clothing: Clothing) -> Worn:
    """Return the mesh of a garment, which does not depend on its colour."""
    return _worn_garment(clothing.garment, clothing.cloth)


@cache
def _worn_garment(garment: str, cloth: str) -> Worn:
    """Return the mesh of a garment, its bone weights and its displacements by expressions."""
    from scipy.sparse import vstack

    panels, slots = _panels(garment, cloth), _slots(garment, cloth)
    counts = np.cumsum([0, *(len(panel.height_mm) for panel in panels)])
    seams = [panel.vertices for panel in panels]
    first_vertex = np.cumsum([0, *(len(one.point) for one in seams)])
    bind = (vstack([panel.bind for panel in panels]) @ skin_sheet().weights).tocsr()
    bone, weight = bone_weights(bind)
    target, point, delta = displacements(bind)
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


def bone_weights(bind: csr_array) -> tuple[Ints, Floats]:
    """Return the four strongest bones (m, 4) of points, and their weights (m, 4).

    bind : (m, p) weights of p points of MakeHuman in each of the m points
    """
    arrays = makehuman_arrays()
    own = arrays["weight"][: bind.shape[1]].astype(np.float64)
    dense = np.zeros((len(own), len(arrays["bone_names"])))
    np.add.at(dense, (np.arange(len(own))[:, None], arrays["bone"][: len(own)]), own)
    spread = np.asarray(bind @ (dense / dense.sum(axis=1, keepdims=True)))
    bone = np.argsort(-spread, axis=1, kind="stable")[:, :BONES_PER_POINT]
    weight = np.take_along_axis(spread, bone, 1)
    return bone.astype(np.int32), (weight / weight.sum(axis=1, keepdims=True)).astype(np.float32)


def displacements(bind: csr_array) -> tuple[Index, Index, Floats]:
    """Return the displacements of points by expressions: the last three arrays of `Worn`.

    bind : see `bone_weights`
    """
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
