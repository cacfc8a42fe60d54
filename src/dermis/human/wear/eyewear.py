"""Meshes and materials of glasses, which follow the head bone as one rigid body."""

from __future__ import annotations

from dermis.human.wear.fabrics import linear_colour
from dermis.human.wear.glasses import FRAMES, glasses_solids
from dermis.human.wear.look import Glasses
from dermis.human.wear.rigid import RigidItems
from dermis.mesh.mesh import Material

_LABEL = "glasses"
_METAL_ROUGHNESS, _ACETATE_ROUGHNESS, _LENS_ROUGHNESS = 0.32, 0.3, 0.12
_PAD_COLOUR, _LENS_COLOUR = (0.55, 0.53, 0.5), (0.012, 0.011, 0.01)


GLASSES_MESHES = RigidItems(glasses_solids)


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
    return tuple(of_slot[slot] for slot in GLASSES_MESHES.slots(glasses))
