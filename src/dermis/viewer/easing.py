"""A camera that glides to where it is wanted, alike at every frame rate."""

from __future__ import annotations

import math

from dermis.scene.camera import Camera
from dermis.viewer.orbit import between

_TIME_S = 0.05  # after which a third of the way is left


class Easing:
    """The camera that is shown, on its way to the one that is wanted."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera

    def advance(self, wanted: Camera, seconds: float) -> Camera:
        """The camera to show after some time [s]."""
        if self.camera != wanted:
            self.camera = between(self.camera, wanted, -math.expm1(-seconds / _TIME_S))
        return self.camera
