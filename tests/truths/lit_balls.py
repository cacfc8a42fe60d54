"""Ball under one light of each kind."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.mesh.primitives import uv_sphere
from dermis.scene.camera import Camera
from dermis.scene.environment import Environment
from dermis.scene.lights import (
    DirectionalLight,
    Light,
    PointLight,
    RectangleLight,
    SphereLight,
    SpotLight,
    StripeLight,
)
from dermis.scene.model import Scene
from dermis.scene.skin import Skin

DRY = Skin(albedo="profile", specular="none", energy="none", direction="lambertian")
COLOUR = (3.0, 2.0, 1.0)
BALL = Head("ball", uv_sphere(50.0, 256, 128), Maps())
MIDDLE = -np.array(BALL.centre_mm)


def at(x: float, y: float, z: float) -> Any:
    """Return a position relative to the centre of the ball."""
    return tuple(np.add(MIDDLE, (x, y, z)))


def ball_scene(*lights: Light, environment: Environment | None = None) -> Scene:
    camera = Camera(position=at(0, 0, 400), target=at(0, 0, 0), frame_mm=130.0)
    return Scene(BALL, lights=lights, camera=camera, skin=DRY, environment=environment)


FROM = {"position": at(200, 150, 300), "target": at(0, 0, 0), "irradiance": COLOUR}
ALONG = {"direction": (-1, -0.5, -1), "irradiance": COLOUR}
LIGHTS = {
    "point": PointLight(**FROM),
    "spot": SpotLight(**{**FROM, "target": at(10, 5, 30)}, inner_degrees=3, outer_degrees=8),
    "wide spot": SpotLight(
        position=at(30, 20, 120), target=at(0, 0, 0), irradiance=COLOUR, inner_degrees=60, outer_degrees=85
    ),
    "directional": DirectionalLight(**ALONG),
    "sun": DirectionalLight(**ALONG, angle_degrees=3),
    "stripe": StripeLight(**ALONG, position=at(3, 2, 0), up=(0.3, 1, 0), width_mm=20, length_mm=60),
    "rectangle": RectangleLight(**FROM, width_mm=200, height_mm=80),
    "sphere": SphereLight(**FROM, radius_mm=60),
}
