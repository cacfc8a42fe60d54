"""Meshes and materials of headwear, which follows the head bone as one rigid body."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from dermis.base.arrays import Doubles, Floats
from dermis.human.model import MEAN_PERSON_WEIGHTS, control_points_mm
from dermis.human.wear.fabrics import CLOTHS, linear_colour
from dermis.human.wear.headwear import headwear_solids
from dermis.human.wear.look import Headwear
from dermis.human.wear.rigid import rigid_worn, solid_points_mm, solid_slots
from dermis.human.wear.tubes import Solid
from dermis.human.wear.worn import Worn
from dermis.mesh.mesh import Material

_LABEL = "headwear"


def headwear_points_mm(control_mm: Floats, headwear: Headwear) -> Doubles:
    """Return the points (m, 3) of headwear on a person [mm].

    control_mm : (p, 3) control points of the person at rest
    """
    return solid_points_mm(headwear_solids(headwear.style, control_mm.astype(np.float64)))


def worn_headwear(headwear: Headwear) -> Worn:
    """Return the mesh of headwear, which depends neither on its cloth nor on its colour."""
    return _worn_headwear(headwear.style)


@cache
def _worn_headwear(style: str) -> Worn:
    return rigid_worn(_mean_solids(style))


def headwear_materials(headwear: Headwear) -> tuple[Material, ...]:
    """Return the materials of headwear, in the order of the material indices of its mesh."""
    cloth, colour = CLOTHS[headwear.cloth], linear_colour(headwear.colour)
    plain = Material("hat cloth", "opaque", colour, roughness=cloth.roughness, label=_LABEL)
    of_slot = {
        "cloth": replace(plain, fabric=cloth.fabric),
        "trim": replace(plain, name="hat trim", fabric=cloth.trim),
        "button": replace(plain, name="hat button", fabric=cloth.fabric),
    }
    return tuple(of_slot[slot] for slot in solid_slots(_mean_solids(headwear.style)))


@cache
def _mean_solids(style: str) -> list[Solid]:
    return headwear_solids(style, control_points_mm(MEAN_PERSON_WEIGHTS).astype(np.float64))
