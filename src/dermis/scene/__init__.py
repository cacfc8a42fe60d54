"""What is to be seen, as plain data without a GPU."""

from dermis.scene.camera import Camera, portrait, profile, three_quarter
from dermis.scene.environment import Environment
from dermis.scene.files import load_camera, load_lights, load_scene
from dermis.scene.lights import *  # noqa: F403 each kind
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

__all__ = [  # besides those of dermis.scene.lights
    "Camera",
    "Environment",
    "Scene",
    "Settings",
    "Skin",
    "load_camera",
    "load_lights",
    "load_scene",
    "portrait",
    "profile",
    "three_quarter",
]
