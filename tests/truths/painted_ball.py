"""Ball of painted skin, for which the image is known."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.apps.truths.person.person import Person, SkinTextures
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.model import Scene

RADIUS_MM = 20.0
CAMERA = Camera(position=(0.0, 0.0, 200.0), frame_mm=50.0)
EVERYWHERE = Environment(name="uniform")


def paint(
    colour: Any = (0.5, 0.3, 0.2), roughness: float = 0.3, strength: float = 1.0, side: int = 16
) -> SkinTextures:
    """Return textures of uniform skin, and of eyes and teeth in one colour each."""
    even = np.ones((side, side), np.float32)
    skin = np.broadcast_to(np.asarray(colour, np.float32), (side, side, 3))
    plain = [even[..., None] * np.float32(c) * np.ones(3, np.float32) for c in (0.1, 0.6, 0.5)]
    gloss = even * np.float32(roughness), even * np.float32(strength)
    return SkinTextures(skin, *gloss, 0.0 * even, plain[0], 6.5, plain[1], (plain[2],) * 2)


def ball(**painted: Any) -> Person:
    """Return a person that is a ball without eyes and hair."""
    return Person("ball", uv_sphere(RADIUS_MM, 64, 32), np.zeros((0, 4, 4)), (), (), paint(**painted))


def scene(**given: Any) -> Scene:
    """Return a scene of a ball, in uniform light by default."""
    lit = {"environment": EVERYWHERE} if "lights" not in given else {}
    head = Head("ball", uv_sphere(RADIUS_MM, 64, 32), Maps())
    return Scene(head, camera=CAMERA, **{**lit, **given})
