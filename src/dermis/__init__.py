"""Physically based rendering of human skin in real time, validated against independent solutions.

>>> import dermis
>>> head = dermis.load_head("lee_perry_smith")  # doctest: +SKIP
>>> scene = dermis.Scene(head, lights=dermis.studio(), camera=dermis.portrait(head))  # doctest: +SKIP
>>> dermis.render(scene, size=(1024, 1024)).shape  # doctest: +SKIP
(1024, 1024, 3)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from dermis.base.renamed import install_renamed_module_finder, successor

if TYPE_CHECKING:
    from dermis.apps.batch.reader import read_dataset
    from dermis.apps.export.run import export_skin
    from dermis.apps.inverse.fitting.fit import fit
    from dermis.apps.inverse.unmixing.unmix import unmix
    from dermis.apps.viewer.windows import view
    from dermis.base.errors import DermisError
    from dermis.frame.hair_motion import HairMotion
    from dermis.frame.observation import Observation
    from dermis.frame.renderer import Renderer, render
    from dermis.frame.spectral import SpectralPicture, render_spectrum
    from dermis.human.hair.look import HairLook
    from dermis.human.makehuman import human_targets
    from dermis.human.person import Human
    from dermis.human.regions.apply import with_regions
    from dermis.human.skin.look import SkinLook
    from dermis.human.wear.look import Clothing, Glasses, Headwear
    from dermis.images.io import write_image
    from dermis.images.movie import MovieWriter
    from dermis.mesh.clip import Clip
    from dermis.mesh.eye_look import EyeLook
    from dermis.mesh.head import Head
    from dermis.mesh.pose import Pose
    from dermis.optics.profiles import load_profile
    from dermis.optics.tissue import Tissue, load_tissue
    from dermis.scene.camera import Camera, full_body, headshot, portrait, side, three_quarter
    from dermis.scene.environment import Environment
    from dermis.scene.files import load_lights, load_scene
    from dermis.scene.heads import load_head
    from dermis.scene.lights import (
        DirectionalLight,
        PointLight,
        RectangleLight,
        SphereLight,
        SpotLight,
        StripeLight,
        studio,
    )
    from dermis.scene.living import SkinState, StateEvent
    from dermis.scene.model import Scene
    from dermis.scene.motion import load_motion
    from dermis.scene.pulse import Pulse
    from dermis.scene.settings import Settings
    from dermis.scene.skin import Skin

_MODULE_OF_NAME = {
    "Head": "mesh.head",
    "load_head": "scene.heads",
    "Human": "human.person",
    "SkinLook": "human.skin.look",
    "EyeLook": "mesh.eye_look",
    "HairLook": "human.hair.look",
    "Clothing": "human.wear.look",
    "Glasses": "human.wear.look",
    "Headwear": "human.wear.look",
    "HairMotion": "frame.hair_motion",
    "human_targets": "human.makehuman",
    "with_regions": "human.regions.apply",
    "DermisError": "base.errors",
    "write_image": "images.io",
    "MovieWriter": "images.movie",
    "load_profile": "optics.profiles",
    "Tissue": "optics.tissue",
    "load_tissue": "optics.tissue",
    "Renderer": "frame.renderer",
    "SpectralPicture": "frame.spectral",
    "render_spectrum": "frame.spectral",
    "Observation": "frame.observation",
    "render": "frame.renderer",
    "Camera": "scene.camera",
    "full_body": "scene.camera",
    "headshot": "scene.camera",
    "portrait": "scene.camera",
    "side": "scene.camera",
    "three_quarter": "scene.camera",
    "Clip": "mesh.clip",
    "load_motion": "scene.motion",
    "Environment": "scene.environment",
    "load_lights": "scene.files",
    "load_scene": "scene.files",
    "DirectionalLight": "scene.lights",
    "PointLight": "scene.lights",
    "RectangleLight": "scene.lights",
    "SphereLight": "scene.lights",
    "SpotLight": "scene.lights",
    "StripeLight": "scene.lights",
    "studio": "scene.lights",
    "Pulse": "scene.pulse",
    "SkinState": "scene.living",
    "StateEvent": "scene.living",
    "Scene": "scene.model",
    "Pose": "mesh.pose",
    "Settings": "scene.settings",
    "Skin": "scene.skin",
    "export_skin": "apps.export.run",
    "fit": "apps.inverse.fitting.fit",
    "read_dataset": "apps.batch.reader",
    "unmix": "apps.inverse.unmixing.unmix",
    "view": "apps.viewer.windows",
}

__all__ = [
    "Camera",
    "Clip",
    "Clothing",
    "DermisError",
    "DirectionalLight",
    "Environment",
    "EyeLook",
    "Glasses",
    "HairLook",
    "HairMotion",
    "Head",
    "Headwear",
    "Human",
    "MovieWriter",
    "Observation",
    "PointLight",
    "Pose",
    "Pulse",
    "RectangleLight",
    "Renderer",
    "Scene",
    "Settings",
    "Skin",
    "SkinLook",
    "SkinState",
    "SpectralPicture",
    "SphereLight",
    "SpotLight",
    "StateEvent",
    "StripeLight",
    "Tissue",
    "export_skin",
    "fit",
    "full_body",
    "headshot",
    "human_targets",
    "load_head",
    "load_lights",
    "load_motion",
    "load_profile",
    "load_scene",
    "load_tissue",
    "portrait",
    "read_dataset",
    "render",
    "render_spectrum",
    "side",
    "studio",
    "three_quarter",
    "unmix",
    "view",
    "with_regions",
    "write_image",
]


def __getattr__(name: str) -> Any:
    """Return a public object; its module is imported on first use, which keeps `import dermis` fast."""
    from importlib import import_module

    if name == "__version__":
        value = import_module(f"{__name__}.base.version").version()
    elif name == "dataset":
        value = import_module(f"{__name__}.{name}")
    elif name in _MODULE_OF_NAME:
        value = getattr(import_module(f"{__name__}.{_MODULE_OF_NAME[name]}"), name)
    elif new := successor(__name__, name):
        return __getattr__(new)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the names of all public objects, whether imported or not."""
    return list({*__all__, "__version__", *(name for name in globals() if name.startswith("__"))})


install_renamed_module_finder()
