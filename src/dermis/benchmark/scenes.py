"""What the measured frames show: a head under some spots, camera and lights on the move."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from dermis.benchmark.cases import Case
from dermis.mesh.head import Head
from dermis.optics.gaussians import GaussianSum
from dermis.optics.profiles import load_profile
from dermis.scene.camera import portrait
from dermis.scene.environment import Environment
from dermis.scene.lights import PointLight, studio
from dermis.scene.model import Scene
from dermis.scene.settings import Settings
from dermis.scene.skin import Skin

_SWAY_MM = 2.0
_LEAST_WEIGHT = 1e-3
_TURN_DEGREES = 25.0  # between one round of the studio's lights and the next


def settings_of(case: Case) -> Settings:
    """How the case is rendered."""
    return Settings(
        size=case.image,
        atlas=case.atlas,
        samples=case.samples,
        technique=case.technique,
    )


def scenes_of(case: Case, head: Head, folder: Path, count: int) -> list[Scene]:
    """The case at `count` moments: neither camera nor lights are twice at the same place.

    folder : for the file of the profile
    """
    skin, camera = Skin(profile=str(_profile_file(case.gaussians, folder))), portrait(head)
    lights = _lights(case.lights)
    around = Environment(name=case.environment) if case.environment else None
    scenes = []
    for k in range(count):
        sway = _SWAY_MM * math.sin(1.0 + k)
        moved = [light.model_copy(update={"position": _aside(light.position, sway)}) for light in lights]
        eye = camera.model_copy(update={"position": _aside(camera.position, sway)})
        scenes.append(Scene(head, lights=tuple(moved), environment=around, camera=eye, skin=skin))
    return scenes


def _aside(place: tuple[float, float, float], sway: float) -> tuple[float, float, float]:
    return place[0] + sway, place[1], place[2]


def _lights(count: int) -> list[PointLight]:
    """The studio's spots, then the same again turned about the head."""
    rig = [light for light in studio() if isinstance(light, PointLight)]
    return [_turned(rig[k % len(rig)], _TURN_DEGREES * (k // len(rig))) for k in range(count)]


def _turned(light: PointLight, degrees: float) -> PointLight:
    x, y, z = light.position
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return light.model_copy(update={"position": (c * x + s * z, y, c * z - s * x)})


def _profile_file(count: int, folder: Path) -> Path:
    path = folder / f"{count}.csv"
    profile = with_terms(load_profile("gpu-gems-3"), count)
    rows = np.column_stack([profile.variance_mm2, profile.weight])
    lines = [",".join(repr(float(number)) for number in row) for row in rows]
    path.write_text("\n".join(["variance_mm2,red,green,blue", *lines]) + "\n", encoding="utf-8")
    return path


def with_terms(profile: GaussianSum, count: int) -> GaussianSum:
    """A profile of `count` Gaussians as wide, with the same albedo: it costs what such a profile costs."""
    if count == len(profile.variance_mm2):
        return profile
    known = np.log(profile.variance_mm2)
    wanted = np.linspace(known[0], known[-1], count) if count > 1 else known[-1:]
    channels = [np.interp(wanted, known, channel) + _LEAST_WEIGHT for channel in profile.weight.T]
    weight = np.stack(channels, axis=1)
    weight *= profile.albedo / weight.sum(axis=0)
    return GaussianSum(f"{count} Gaussians", np.exp(wanted), weight)
