"""What hands move on the page: the camera and the lights."""

from __future__ import annotations

from typing import Any

import numpy as np

from dermis.frame.inputs import Inputs, pinhole
from dermis.mesh.outline import Outline
from dermis.scene.lights import SpotLight
from dermis.scene.model import Scene
from dermis.scene.settings import Settings

Json = dict[str, Any]


def hands_of(scene: Scene, inputs: Inputs) -> Json:
    """The camera, the lights that can be dragged, and the outline that shadow maps are fitted to."""
    settings: Settings = inputs.settings
    camera, seen = scene.camera, pinhole(scene.camera, scene.head, settings)
    outline: Outline = scene.head.mesh.outline
    return {
        "centre": [float(x) for x in scene.head.centre_mm],
        "camera": {
            "position": list(camera.position),
            "target": list(camera.target),
            "up": list(camera.up),
            "half": list(seen.window.half),
            "shift": list(seen.window.shift),
        },
        "samples": inputs.camera.places.tolist(),
        "outline": np.asarray(outline.places_mm, np.float32).round(3).ravel().tolist(),
        "slack": outline.slack_mm,
        "middle": list(outline.middle_mm),
        "shadow_size": settings.shadow_size,
        "lights": [_light(one) for one in scene.lights],
    }


def _light(light: Any) -> Json | None:
    """A light that stands somewhere and has one shadow map; None for others, which stay where they are."""
    if not isinstance(light, SpotLight) or not light.shadows:
        return None
    return {"position": list(light.position), "target": list(light.target), "softness": light.softness_mm}
