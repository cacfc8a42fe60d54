"""What is to be seen, as plain data without a GPU."""

from dermis.scene.camera import Camera, portrait, profile, three_quarter
from dermis.scene.files import load_camera, load_lights, load_scene
from dermis.scene.lights import DirectionalLight, PointLight, SpotLight, studio
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

__all__ = [
    "Camera",
    "DirectionalLight",
    "PointLight",
    "Scene",
    "Settings",
    "Skin",
    "SpotLight",
    "load_camera",
    "load_lights",
    "load_scene",
    "portrait",
    "profile",
    "studio",
    "three_quarter",
]
