"""Meshes and materials of glasses, which follow the head bone as one rigid body."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.human.makehuman import makehuman_arrays
from dermis.human.model import MEAN_PERSON_WEIGHTS, control_points_mm
from dermis.human.wear.fabrics import linear_colour
from dermis.human.wear.glasses import FRAMES, glasses_solids
from dermis.human.wear.look import Glasses
from dermis.human.wear.worn import Worn
from dermis.mesh.fabric import MM_PER_UV
from dermis.mesh.mesh import Material
from dermis.mesh.rig import BONES_PER_POINT

_LABEL = "glasses"
_METAL_ROUGHNESS, _ACETATE_ROUGHNESS, _LENS_ROUGHNESS = 0.32, 0.3, 0.12
_PAD_COLOUR, _LENS_COLOUR = (0.55, 0.53, 0.5), (0.012, 0.011, 0.01)


def glasses_points_mm(control_mm: Floats, glasses: Glasses) -> Doubles:
    """Return the points (m, 3) of glasses on a person [mm].

    control_mm : (p, 3) control points of the person at rest
    """
    return np.concatenate(
        [part.points for part in glasses_solids(glasses.style, control_mm.astype(np.float64))]
    )


def worn_glasses(glasses: Glasses) -> Worn:
    """Return the mesh of glasses, which does not depend on their colour."""
    return _worn_glasses(glasses.style)


@cache
def _worn_glasses(style: str) -> Worn:
    solids = glasses_solids(style, control_points_mm(MEAN_PERSON_WEIGHTS).astype(np.float64))
    slots, counts = _slots(style), np.cumsum([0, *(len(part.points) for part in solids)])
    points, count = np.concatenate([part.points for part in solids]), int(counts[-1])
    head = list(map(str, makehuman_arrays()["bone_names"])).index("head")
    weight = np.zeros((count, BONES_PER_POINT), np.float32)
    weight[:, 0] = 1.0
    return Worn(
        np.arange(count, dtype=np.int32),
        (points[:, [2, 1]] / MM_PER_UV).astype(np.float32),
        np.concatenate([part.triangles + first for part, first in zip(solids, counts, strict=False)]),
        np.repeat([slots.index(part.slot) for part in solids], [len(part.triangles) for part in solids]),
        np.full((count, BONES_PER_POINT), head, np.int32),
        weight,
        np.zeros(0, np.int64),
        np.zeros(0, np.int64),
        np.zeros((0, 3), np.float32),
    )


def glasses_materials(glasses: Glasses) -> tuple[Material, ...]:
    """Return the materials of glasses, in the order of the material indices of their mesh."""
    metal, colour = FRAMES[glasses.style].is_metal, linear_colour(glasses.colour)
    roughness = _METAL_ROUGHNESS if metal else _ACETATE_ROUGHNESS
    of_slot = {
        "frame": Material(
            "glasses frame", "opaque", colour, roughness=roughness, metalness=float(metal), label=_LABEL
        ),
        "lens": Material("dark lens", "opaque", _LENS_COLOUR, roughness=_LENS_ROUGHNESS, label=_LABEL),
        "pad": Material("nose pad", "opaque", _PAD_COLOUR, roughness=_ACETATE_ROUGHNESS, label=_LABEL),
    }
    return tuple(of_slot[slot] for slot in _slots(glasses.style))


@cache
def _slots(style: str) -> tuple[str, ...]:
    solids = glasses_solids(style, control_points_mm(MEAN_PERSON_WEIGHTS).astype(np.float64))
    return tuple(dict.fromkeys(part.slot for part in solids))
