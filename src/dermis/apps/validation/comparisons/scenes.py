"""The scenes on which techniques are judged: lit from the front, through the ear, and by a laser's stripe."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Literal

import numpy as np

from dermis.apps.truths.slab_mc import monte_carlo_profile
from dermis.mesh.head import Head
from dermis.mesh.maps import Maps
from dermis.optics.gaussians import GaussianSum
from dermis.optics.half_space import COUNTED_MODEL
from dermis.optics.media import Medium
from dermis.optics.profiles import fit_radial, write_profile
from dermis.optics.tissue import Tissue
from dermis.scene.camera import Camera, portrait, three_quarter
from dermis.scene.lights import Light, SpotLight, StripeLight
from dermis.scene.model import Scene
from dermis.scene.skin import Skin

_WHITE = (3.14, 3.14, 3.14)
_NOSE = (14.0, -28.0, 90.0)  # between tip, wing and lip, from the head's centre [mm]
_EAR_RANGE_MM = 60.0  # above and below the centre; farther below, shoulders are wider


def _front_lights(head: Head) -> tuple[Light, ...]:
    """Return a key light from the upper left, whose shadow edges cross the face."""
    return (SpotLight(position=(450.0, 350.0, 750.0), irradiance=_WHITE),)


def _back_lights(head: Head) -> tuple[Light, ...]:
    """Return a lamp behind the left ear."""
    ear = _ear_position(head)
    return (SpotLight(position=(ear[0] + 150.0, 60.0, -600.0), target=ear, irradiance=(12.0, 12.0, 12.0)),)


def _laser_lights(head: Head) -> tuple[Light, ...]:
    """Return a vertical sheet of light over the cheek and the ear's front edge."""
    ear = _ear_position(head)
    place = (ear[0] - 12.0, ear[1], ear[2])
    return (StripeLight(direction=(-0.55, 0.0, -1.0), position=place, irradiance=(30.0, 30.0, 30.0)),)


LIGHTS: dict[str, Callable[[Head], tuple[Light, ...]]] = {"front": _front_lights, "back": _back_lights, "laser": _laser_lights}


def _ear_position(head: Head) -> tuple[float, float, float]:
    """Return the outermost point of the head's left half at the height of its ears."""
    places = head.mesh.positions - head.centre_mm
    off = np.abs(places[:, 1])
    beside = places[off <= max(_EAR_RANGE_MM, float(off.min()))]
    x, y, z = (float(c) for c in beside[beside[:, 0].argmax()])
    return (x, y, z)


def _ear_camera(head: Head) -> Camera:
    x, y, z = _ear_position(head)
    return Camera(position=(x + 420.0, y + 20.0, z + 420.0), target=(x - 8.0, y, z), frame_mm=95.0)


def _cheek_camera(head: Head) -> Camera:
    spot = head.frontmost(40.0, -35.0)
    return Camera(position=(spot[0] + 250.0, spot[1], spot[2] + 300.0), target=spot, frame_mm=90.0)


def _nose_camera(head: Head) -> Camera:
    return Camera(position=(_NOSE[0], _NOSE[1], 900.0), target=_NOSE, frame_mm=90.0)


REGIONS: dict[str, Callable[[Head], Camera]] = {
    "portrait": portrait,
    "three-quarter": three_quarter,
    "ear": _ear_camera,
    "cheek": _cheek_camera,
    "nose": _nose_camera,
}


def comparison_scene(head: Head, light: str, region: str, profile: str) -> Scene:
    """Return a head without maps or surface reflection, its skin in the profile's own colour.

    light, region : of LIGHTS and REGIONS
    profile : name or file
    """
    bare = Head(head.name, head.mesh, Maps(), head.attribution)
    skin = Skin(profile=profile, albedo="profile", specular="none", energy="none", direction="lambertian")
    return Scene(bare, lights=LIGHTS[light](head), camera=REGIONS[region](head), skin=skin)


@contextmanager
def medium_scene(
    head: Head, light: str, region: str, body: Medium, model: ModelName | None = None
) -> Iterator[tuple[Scene, GaussianSum]]:
    """Provide `comparison_scene` with a medium's profile, a file within the context, and the profile."""
    profile = medium_gaussians(body, model)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "profile.toml"
        write_profile(file, profile, {"model": COUNTED_MODEL if profile.from_photons else "layered"})
        yield comparison_scene(head, light, region, str(file)), profile


def default_region(light: str) -> str:
    """Return the region in which a light's effect is largest."""
    return {"back": "ear", "laser": "three-quarter"}.get(light, "portrait")


ModelName = Literal["counted", "layered", "montecarlo"]
"""By tables of photons, by layered diffusion, or by photons one by one."""
_PHOTONS = 2_000_000  # a channel


def medium_gaussians(body: Medium, model: ModelName | None = None) -> GaussianSum:
    """Return six Gaussians for a medium.

    model : by default tables of photons where there are some, else layered diffusion

    Raises DermisError for a medium that has no tables.
    """
    if model == "montecarlo":
        return fit_radial(monte_carlo_profile(body, photons=_PHOTONS), body.name)
    return fit_radial(Tissue(body).profile(model), body.name)
