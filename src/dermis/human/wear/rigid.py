"""Meshes of items that follow the head bone as rigid bodies: glasses and headwear."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.human.makehuman import makehuman_arrays
from dermis.human.model import MEAN_PERSON_WEIGHTS, control_points_mm
from dermis.human.wear.look import Glasses, Headwear
from dermis.human.wear.panels import PanelVertices
from dermis.human.wear.tubes import Solid
from dermis.human.wear.worn import Worn
from dermis.mesh.fabric import MM_PER_UV
from dermis.mesh.rig import BONES_PER_POINT

Styled = Glasses | Headwear


class RigidItems:
    """Meshes of a kind of item in several styles, such as glasses; colour and cloth do not matter.

    make_solids : function that returns the parts of a style on a person, from the control points (p, 3) of
        the person at rest [mm]
    """

    def __init__(self, make_solids: Callable[[str, Doubles], list[Solid]]) -> None:
        self._make_solids = make_solids
        self._mean_solids = cache(self._solids_of_mean_person)
        self._worn = cache(lambda style: rigid_worn(self._mean_solids(style)))

    def points_mm(self, control_mm: Floats, item: Styled) -> Doubles:
        """Return the points (m, 3) of an item on a person [mm].

        control_mm : (p, 3) control points of the person at rest
        """
        return solid_points_mm(self._make_solids(item.style, control_mm.astype(np.float64)))

    def worn(self, item: Styled) -> Worn:
        """Return the mesh of an item."""
        return self._worn(item.style)

    def slots(self, item: Styled) -> tuple[str, ...]:
        """Return the names of the materials of an item, in the order of the material indices of its mesh."""
        return solid_slots(self._mean_solids(item.style))

    def _solids_of_mean_person(self, style: str) -> list[Solid]:
        return self._make_solids(style, control_points_mm(MEAN_PERSON_WEIGHTS).astype(np.float64))


def solid_points_mm(solids: Sequence[Solid]) -> Doubles:
    """Return the points (m, 3) of all solids [mm]."""
    return np.concatenate([part.points for part in solids])


def solid_slots(solids: Sequence[Solid]) -> tuple[str, ...]:
    """Return the names of the materials of solids, each once, in their order."""
    return tuple(dict.fromkeys(part.slot for part in solids))


def rigid_worn(solids: Sequence[Solid]) -> Worn:
    """Return the mesh of solids on the mean person, which moves with the head bone and has no expressions."""
    slots, counts = solid_slots(solids), np.cumsum([0, *(len(part.points) for part in solids)])
    seams = [_vertices(part) for part in solids]
    first_vertex, count = np.cumsum([0, *(len(one.point) for one in seams)]), int(counts[-1])
    head = list(map(str, makehuman_arrays()["bone_names"])).index("head")
    weight = np.zeros((count, BONES_PER_POINT), np.float32)
    weight[:, 0] = 1.0
    return Worn(
        np.concatenate([one.point + first for one, first in zip(seams, counts, strict=False)]),
        np.concatenate([one.uv_mm for one in seams]).astype(np.float32) / np.float32(MM_PER_UV),
        np.concatenate([one.triangles + first for one, first in zip(seams, first_vertex, strict=False)]),
        np.repeat([slots.index(part.slot) for part in solids], [len(part.triangles) for part in solids]),
        np.full((count, BONES_PER_POINT), head, np.int32),
        weight,
        np.zeros(0, np.int64),
        np.zeros(0, np.int64),
        np.zeros((0, 3), np.float32),
    )


def _vertices(solid: Solid) -> PanelVertices:
    """Return the vertices of a solid; one without coordinates on cloth is projected from its side."""
    if solid.vertices is not None:
        return solid.vertices
    point = np.arange(len(solid.points), dtype=np.int32)
    return PanelVertices(point, solid.points[:, [2, 1]], solid.triangles)
