"""Meshes and materials of headwear, which follows the head bone as one rigid body."""

from __future__ import annotations

from dataclasses import replace

from dermis.human.wear.fabrics import CLOTHS, linear_colour
from dermis.human.wear.headwear import headwear_solids
from dermis.human.wear.look import Headwear
from dermis.human.wear.rigid import RigidItems
from dermis.mesh.mesh import Material

_LABEL = "headwear"


HEADWEAR_MESHES = RigidItems(headwear_solids)


def headwear_materials(headwear: Headwear) -> tuple[Material, ...]:
    """Return the materials of headwear, in the order of the material indices of its mesh."""
    cloth, colour = CLOTHS[headwear.cloth], linear_colour(headwear.colour)
    plain = Material("hat cloth", "opaque", colour, roughness=cloth.roughness, label=_LABEL)
    of_slot = {
        "cloth": replace(plain, fabric=cloth.fabric),
        "trim": replace(plain, name="hat trim", fabric=cloth.trim),
        "button": replace(plain, name="hat button", fabric=cloth.fabric),
    }
    return tuple(of_slot[slot] for slot in HEADWEAR_MESHES.slots(headwear))
