"""Scenes in which techniques are compared: front light, light through an ear, and a laser's stripe."""

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
from dermis.optics.half_space import PHOTON_TABLE_MODEL
from dermis.optics.media import Medium
from dermis.optics.profiles import fit_radial, write_profile
from dermis.optics.tissue import Tissue
from dermis.scene.camera import Camera, portrait, three_quarter
from dermis.scene.lights import Light, SpotLight, StripeLight
from dermis.scene.model import Scene
from dermis.scene.skin import Skin

_WHITE_IRRADIANCE = (3.14, 3.14, 3.14)
_NOSE_POINT_MM = (14.0, -28.0, 90.0)  # between tip, wing and lip, relative to the head's centre [mm]
_MAX_EAR_HEIGHT_MM = 60.0  # largest height above or below the centre at which ears are sought


def _front_lights(head: Head) -> tuple[Light, ...]:
    """Return a key light from the upper left, whose shadow edges cross the face."""
    return (SpotLight(position=(450.0, 350.0, 750.0), irradiance=_WHITE_IRRADIANCE),)


def _back_lights(head: Head) -> tuple[Light, ...]:
    """Return a light behind the left ear."""
    ear = _ear_position(head)
    return (SpotLight(position=(ear[0] + 150.0, 60.0, -600.0), target=ear, irradiance=(12.0, 12.0, 12.0)),)


def _laser_lights(head: Head) -> tuple[Light, ...]:
    """Return a vertical sheet of light across the cheek and the front edge of the ear."""
    ear = _ear_position(head)
    stripe_centre = (ear[0] - 12.0, ear[1], ear[2])
    return (StripeLight(direction=(-0.55, 0.0, -1.0), position=stripe_centre, irradiance=(30.0, 30.0, 30.0)),)


LIGHTS: dict[str, Callable[[Head], tuple[Light, ...]]] = {
    "front": _front_lights,
    "back": _back_lights,
    "laser": _laser_lights,
}


def _ear_position(head: Head) -> tuple[float, float, float]:
    """Return the leftmost point of a head at the height of the ears, relative to the head's centre [mm]."""
    points = head.mesh.positions - head.centre_mm
    height_offset = np.abs(points[:, 1])
    at_ear_height = points[height_offset <= max(_MAX_EAR_HEIGHT_MM, float(height_offset.min()))]
    x, y, z = (float(c) for c in at_ear_height[at_ear_height[:, 0].argmax()])
    return (x, y, z)


def _ear_camera(head: Head) -> Camera:
    x, y, z = _ear_position(head)
    return Camera(position=(x + 420.0, y + 20.0, z + 420.0), target=(x - 8.0, y, z), frame_mm=95.0)


def _cheek_camera(head: Head) -> Camera:
    spot = head.frontmost_point_mm(40.0, -35.0)
    return Camera(position=(spot[0] + 250.0, spot[1], spot[2] + 300.0), target=spot, frame_mm=90.0)


def _nose_camera(head: Head) -> Camera:
    return Camera(
        position=(_NOSE_POINT_MM[0], _NOSE_POINT_MM[1], 900.0), target=_NOSE_POINT_MM, frame_mm=90.0
    )


REGIONS: dict[str, Callable[[Head], Camera]] = {
    "portrait": portrait,
    "three-quarter": three_quarter,
    "ear": _ear_camera,
    "cheek": _cheek_camera,
    "nose": _nose_camera,
}


def comparison_scene(head: Head, light: str, region: str, profile: str) -> Scene:
    """Return a scene of a head in the colour of its diffusion profile, without maps or surface reflection.

    light : name of the light in LIGHTS
    region : name of the visible region in REGIONS
    profile : name or file of the diffusion profile
    """
    plain_head = Head(head.name, head.mesh, Maps(), head.attribution)
    skin = Skin(profile=profile, albedo="profile", specular="none", energy="none", direction="lambertian")
    return Scene(plain_head, lights=LIGHTS[light](head), camera=REGIONS[region](head), skin=skin)


@contextmanager
def medium_scene(
    head: Head, light: str, region: str, medium: Medium, model: ModelName | None = None
) -> Iterator[tuple[Scene, GaussianSum]]:
    """Yield a `comparison_scene` with the diffusion profile of a medium, and the profile itself.

    The scene reads the profile from a temporary file, which is deleted when the context ends.
    """
    profile = medium_gaussians(medium, model)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "profile.toml"
        write_profile(file, profile, {"model": PHOTON_TABLE_MODEL if profile.from_photons else "layered"})
        yield comparison_scene(head, light, region, str(file)), profile


def default_region(light_name: str) -> str:
    """Return the region of the face in which a light of the comparisons has the largest effect."""
    return {"back": "ear", "laser": "three-quarter"}.get(light_name, "portrait")


ModelName = Literal["counted", "layered", "montecarlo"]
"""Scattering model from which a diffusion profile is computed.

"counted": tabulated photon counts of earlier Monte Carlo simulations. "layered": layered diffusion.
"montecarlo": a new Monte Carlo simulation.
"""
_PHOTONS_PER_CHANNEL = 2_000_000  # per channel


def medium_gaussians(medium: Medium, model: ModelName | None = None) -> GaussianSum:
    """Return the sum of six Gaussians that fits a medium's diffusion profile.

    model : scattering model; None for "counted", the tabulated Monte Carlo profiles, or for "layered" if no
        table covers the medium

    Raises DermisError if the model is "counted" and no table covers the medium.
    """
    if model == "montecarlo":
        return fit_radial(monte_carlo_profile(medium, photons=_PHOTONS_PER_CHANNEL), medium.name)
    return fit_radial(Tissue(medium).profile(model), medium.name)
