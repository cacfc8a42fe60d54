"""The environment as the shaders read it: panorama and sun-like peaks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.environment.mirrors import equivalent_mirrors
from dermis.environment.panorama import Sun, load_panorama
from dermis.environment.prefilter import prefilter
from dermis.frame.lights.records import sun_lights
from dermis.gpu import ComputeProgram, Device, Memo, Record, Texture, make_texture, upload
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.skin import Skin, lobe_name

_BRIGHTEST = 65504.0  # of 16-bit floats
_SHARPEST_ROWS = 2048  # of a panorama that is looked at


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A panorama on the device.

    panorama : layers of irradiance and of reflections, black without an environment
    suns : its peaks
    brightest : largest irradiance from the rest
    """

    panorama: Texture
    suns: tuple[Sun, ...]
    brightest: float = 0.0


def load_surroundings(device: Device, name: str | None) -> Surroundings:
    """The prefiltered panorama of an environment, or of none.

    Raises DermisError when there is no such environment.
    """
    if name is None:
        return Surroundings(make_texture(device, (1, 1), "rgba16float", layers=2, use="map"), ())
    made = prefilter(name)
    return Surroundings(_layered(device, made.layers), made.suns, float(made.layers[0].max()))


def sharp_panorama(device: Device, name: str) -> Texture:
    """A panorama as it is, suns included, as the first of two layers."""
    radiance = load_panorama(name, most_rows=_SHARPEST_ROWS).astype(np.float32)
    return _layered(device, [radiance, np.zeros_like(radiance)])


def _layered(device: Device, layers: Sequence[NDArray[np.float32]] | NDArray[np.float32]) -> Texture:
    height, width = layers[0].shape[:2]
    size = width + 2, height + 2
    texture = make_texture(device, size, "rgba16float", layers=len(layers), use="map")
    for index, layer in enumerate(layers):
        texels = np.dstack([_bordered(layer), np.ones(size[::-1])])
        upload(device, texture, np.minimum(texels, _BRIGHTEST), layer=index)
    return texture


def _bordered(layer: NDArray[np.float32]) -> NDArray[np.float32]:
    """A layer with a border for filters: beyond a pole its first row again, rotated by half a turn."""
    half = layer.shape[1] // 2
    rows = np.concatenate([np.roll(layer[:1], half, axis=1), layer, np.roll(layer[-1:], half, axis=1)])
    return np.concatenate([rows[:, -1:], rows, rows[:, :1]], axis=1)


def with_suns(memo: Memo, scene: Scene, surroundings: Surroundings) -> Scene:
    """The scene with its environment's peaks among its lights."""
    environment = scene.environment
    if environment is None or not surroundings.suns:
        return scene
    suns = memo.keep(sun_lights, surroundings.suns, environment)
    return replace(scene, lights=(*scene.lights, *suns))


def brightest(scene: Scene, surroundings: Surroundings) -> float:
    """Irradiance that a surface gets from all lights, as they were given, and the environment together.

    scene : with its environment's peaks among its lights
    """
    around = surroundings.brightest * scene.environment.exposure if scene.environment else 0.0
    return around + sum(max(light.irradiance) for light in scene.lights)


def environment_record(
    program: ComputeProgram,
    environment: Environment | None,
    skin: Skin,
    total: NDArray[np.float64],
    occluded: bool,
) -> Record:
    """The shader's record of the environment.

    total : (3,) the profile's albedo as the frame uses it
    """
    if environment is None:
        return program.record("Environment")
    angle = np.radians(environment.rotation_degrees)
    return program.record(
        "Environment",
        turn=(np.cos(angle), np.sin(angle)),
        exposure=environment.exposure,
        albedo=np.minimum(total, 1.0),
        occluded=int(occluded),
        mirrors=equivalent_mirrors(lobe_name(skin)).reshape(-1, 4),
    )
