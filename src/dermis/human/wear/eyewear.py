"""Meshes and materials of glasses, which follow the head bone as one rigid body."""

from __future__ import annotations

from functools import cache

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.human.model import MEAN_PERSON_WEIGHTS, control_points_mm
from dermis.human.wear.fabrics import linear_colour
from dermis.human.wear.glasses import FRAMES, glasses_solids
from dermis.human.wear.look import Glasses
from dermis.human.wear.rigid import rigid_worn, solid_points_mm, solid_slots
from dermis.human.wear.tubes import Solid
from dermis.human.wear.worn import Worn
from dermis.mesh.mesh import Material

_LABEL = "glasses"
_METAL_ROUGHNESS, _ACETATE_ROUGHNESS, _LENS_ROUGHNESS = 0.32, 0.3, 0.12
_PAD_COLOUR, _LENS_COLOUR = (0.55, 0.53, 0.5), (0.012, 0.011, 0.01)


def glasses_points_mm(control_mm: Floats, glasses: Glasses) -> Doubles:
    """Return the points (m, 3) of glasses on a person [mm].

    control_mm : (p, 3) control points of the person at rest
    """
    return solid_points_mm(glasses_solids(glasses.style, control_mm.astype(np.float64)))


def worn_glasses(glasses: Glasses) -> Worn:
    """Return the mesh of glasses, which does not depend on their colour."""
    return _worn_glasses(glasses.style)


@cache
def _worn_glasses(style: str) -> Worn:
    return rigid_worn(_mean_solids(style))


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
    return tuple(of_slot[slot] for slot in solid_slots(_mean_solids(glasses.style)))


@cache
def _mean_solids(style: str) -> list[Solid]:
    return glasses_solids(style, control_points_mm(MEAN_PERSON_WEIGHTS).astype(np.float64))
