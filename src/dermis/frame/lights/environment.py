"""Environment on the device: a prefiltered panorama, and the suns in it, which are rendered as lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from dermis.environment.isotropic_lobes import isotropic_lobe_table
from dermis.environment.panorama import Sun, load_panorama
from dermis.environment.prefilter import prefilter
from dermis.frame.lights.records import sun_lights
from dermis.gpu import ComputeProgram, Device, Memo, Texture, UniformRecord, make_texture, upload
from dermis.optics.bands import Bands
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.skin import Skin, lobe_name

_MAX_HALF_FLOAT = 65504.0  # largest 16-bit float
_MAX_BACKGROUND_ROWS = 2048  # limit of a panorama in the background


@dataclass(frozen=True, eq=False)
class EnvironmentMap:
    """Prefiltered panorama on the device, and the suns that were removed from the panorama.

    panorama : texture whose first layer holds irradiance, and whose further layers hold reflections for
        increasing roughness; black without an environment
    suns : bright peaks of the panorama, which are rendered as lights
    peak_irradiance : largest irradiance in the panorama without its suns [-]
    """

    panorama: Texture
    suns: tuple[Sun, ...]
    peak_irradiance: float = 0.0


def load_environment_map(
    device: Device, environment_name: str | None, bands: Bands | None = None
) -> EnvironmentMap:
    """Return the prefiltered panorama of an environment, or a black panorama if the name is None.

    bands : wavelengths in the place of red, green and blue

    Raises DermisError when there is no such environment.
    """
    if environment_name is None:
        return EnvironmentMap(
            make_texture(device, (1, 1), "rgba16float", layer_count=2, content_source="map"), ()
        )
    prefiltered = prefilter(environment_name)
    layers, suns = prefiltered.layers, prefiltered.suns
    if bands is not None:
        layers = np.asarray(layers @ bands.of_rgb.T.astype(np.float32), np.float32)
        suns = tuple(replace(sun, irradiance=bands.reflectance(sun.irradiance)) for sun in suns)
    return EnvironmentMap(_upload_panorama_layers(device, layers), suns, float(layers[0].max()))


def unfiltered_panorama(device: Device, environment_name: str) -> Texture:
    """Upload an unfiltered panorama, suns included, for sharp backgrounds.

    The texture has a second layer, which is black.
    """
    radiance = load_panorama(environment_name, max_rows=_MAX_BACKGROUND_ROWS).astype(np.float32)
    return _upload_panorama_layers(device, [radiance, np.zeros_like(radiance)])


def _upload_panorama_layers(
    device: Device, panorama_layers: Sequence[NDArray[np.float32]] | NDArray[np.float32]
) -> Texture:
    height, width = panorama_layers[0].shape[:2]
    size = width + 2, height + 2
    texture = make_texture(
        device, size, "rgba16float", layer_count=len(panorama_layers), content_source="map"
    )
    for index, layer in enumerate(panorama_layers):
        texels = np.dstack([_with_border(layer), np.ones(size[::-1])])
        upload(device, texture, np.minimum(texels, _MAX_HALF_FLOAT), layer=index)
    return texture


def _with_border(panorama: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a panorama with a border of one texel, so that bilinear filtering is correct at its edges.

    On the left and right, the border wraps around. Beyond a pole, the border continues on the opposite side
    of the sphere.
    """
    half = panorama.shape[1] // 2
    rows = np.concatenate(
        [np.roll(panorama[:1], half, axis=1), panorama, np.roll(panorama[-1:], half, axis=1)]
    )
    return np.concatenate([rows[:, -1:], rows, rows[:, :1]], axis=1)


def add_suns(memo: Memo, scene: Scene, environment_map: EnvironmentMap) -> Scene:
    """Return the scene with the suns of its environment appended to its lights."""
    environment = scene.environment
    if environment is None or not environment_map.suns:
        return scene
    suns = memo.get(sun_lights, environment_map.suns, environment)
    return replace(scene, lights=(*scene.lights, *suns))


def peak_irradiance(scene: Scene, environment_map: EnvironmentMap) -> float:
    """Return an upper bound of the irradiance in a scene [-].

    It is the irradiance of a surface that faces all lights and the brightest part of the environment.

    scene : scene whose lights include the suns of its environment
    environment_map : prefiltered panorama of the environment
    """
    environment = environment_map.peak_irradiance * scene.environment.exposure if scene.environment else 0.0
    return environment + sum(max(light.irradiance) for light in scene.lights)


def environment_record(
    shading_program: ComputeProgram,
    environment: Environment | None,
    skin: Skin,
    albedo: NDArray[np.float64],
    has_occlusion: bool,
) -> UniformRecord:
    """Return the uniform record of the environment.

    The record holds the rotation and the exposure of the environment, and the albedo and the reflection lobes
    of the skin that the environment lights.

    shading_program : program of the shading pass, which declares the record
    albedo : (3,) albedo of skin where its colour map is white [-]
    has_occlusion : whether the head hides parts of the environment from its own skin
    """
    if environment is None:
        return shading_program.make_record("Environment")
    angle = np.radians(environment.rotation_degrees)
    return shading_program.make_record(
        "Environment",
        turn=(np.cos(angle), np.sin(angle)),
        exposure=environment.exposure,
        albedo=np.minimum(albedo, 1.0),
        occluded=int(has_occlusion),
        mirrors=isotropic_lobe_table(lobe_name(skin)).reshape(-1, 4),
    )
