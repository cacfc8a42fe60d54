"""Ball with morph targets named as ARKit's blend shapes and with bones, for captures of a face."""

from __future__ import annotations

from dataclasses import replace

from random_rig import random_rig

from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.mesh.rig import Rig

NAMES = ("jawOpen", "eyeBlinkLeft", "mouthSmileRight", *(f"other{k}" for k in range(5)))


def captured_head(*bones: str) -> Head:
    """Return the ball with bones of these names, in a row; without names it has no skeleton."""
    rig = random_rig()
    skeleton = replace(rig.skeleton, names=bones) if bones else None
    moved = Rig(rig.positions_mm, replace(rig.targets, names=NAMES), skeleton)
    return Head("ball", uv_sphere(100.0, 8, 4), Maps(), rig=moved)


HEAD = captured_head("root", "neck", "head", "LeftEye")
