"""Scene description that needs no GPU: head, skin, lights, camera, environment and settings."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from dermis.base.renamed import successor

if TYPE_CHECKING:
    from dermis.scene.camera import Camera, full_body, headshot, portrait, side, three_quarter
    from dermis.scene.environment import Environment
    from dermis.scene.files import load_camera, load_lights, load_scene
    from dermis.scene.lights import *  # noqa: F403 each kind
    from dermis.scene.model import Scene
    from dermis.scene.settings import Settings
    from dermis.scene.skin import Skin

_NAMES_BY_MODULE = {
    "camera": ("Camera", "full_body", "headshot", "portrait", "side", "three_quarter"),
    "environment": ("Environment",),
    "files": ("load_camera", "load_lights", "load_scene"),
    "model": ("Scene",),
    "settings": ("Settings",),
    "skin": ("Skin",),
}

__all__ = [  # in addition to those of dermis.scene.lights
    "Camera",
    "Environment",
    "Scene",
    "Settings",
    "Skin",
    "full_body",
    "headshot",
    "load_camera",
    "load_lights",
    "load_scene",
    "portrait",
    "side",
    "three_quarter",
]


def __getattr__(name: str) -> Any:
    """Return a public object of this package.

    The object's module is imported on first use, so the help of the command line stays fast.
    """
    if new := successor(__name__, name):
        return __getattr__(new)
    home = next((home for home, names in _NAMES_BY_MODULE.items() if name in names), "lights")
    module = import_module(f"{__name__}.{home}")
    if name.startswith("_") or not hasattr(module, name):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value = getattr(module, name)
    return value
