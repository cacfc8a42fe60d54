"""Environment on the device: a prefiltered panorama, and the suns in it, which are rendered as lights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from dermis.environment.isotropic_lobes import isotropic_lobe_table
from dermis.environment.panorama import Sun, load_panorama
from dermis.environment.prefilter import LAYER_ROUGHNESSES, prefilter
from dermis.frame.lights.records import sun_lights
from dermis.gpu import ComputeProgram, Device, Memo, Texture, UniformRecord, make_texture, upload
from dermis.images.colour import luminance
from dermis.optics.bands import Bands
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.skin import Skin, lobe_name

_MAX_HALF_FLOAT = 65504.0  # largest 16-bit float
_MAX_BACKGROUND_ROWS = 2048  # limit of a panorama in the background
SKY_DIRECTIONS = 32
"""Number of directions for which the transmittance of hair is computed, see sky_transmittance.wgsl."""
_BROAD_LAYER = int(np.searchsorted(LAYER_ROUGHNESSES, 0.3))
_MIN_SKY_LUMINANCE = 0.2  # of a direction, relative to the mean of all directions


@dataclass(frozen=True, eq=False)
class EnvironmentMap:
    """Prefiltered panorama on the device, and the suns that were removed from the panorama.

    panorama : texture whose first layer holds irradiance, and whose further layers hold reflections for
        increasing roughness; black without an environment
    suns : bright peaks of the panorama, which are rendered as lights
    peak_irradiance : largest irradiance in the panorama without its suns [-]
    broad_luminance : (h, 2 h) luminance of the panorama blurred by a broad lobe; empty without an environment
    """

    panorama: Texture
    suns: tuple[Sun, ...]
    peak_irradiance: float = 0.0
    broad_luminance: NDArray[np.float32] = field(default_factory=lambda: np.zeros((0, 0), np.float32))


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
    return EnvironmentMap(
        _upload_panorama_layers(device, layers),
        suns,
        float(layers[0].max()),
        np.asarray(luminance(prefiltered.layers[1 + _BROAD_LAYER]), np.float32),
    )


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


def sky_directions() -> NDArray[np.float64]:
    """Return the directions (n, 3) in which sky_transmittance.wgsl marches, a Fibonacci lattice."""
    k = np.arange(SKY_DIRECTIONS)
    z = 1.0 - (2.0 * k + 1.0) / SKY_DIRECTIONS
    turn = np.pi * (3.0 - np.sqrt(5.0)) * k
    sine = np.sqrt(1.0 - z * z)
    return np.stack([sine * np.cos(turn), sine * np.sin(turn), z], axis=-1)


def sky_luminance(broad_luminance: NDArray[np.float32], environment: Environment) -> NDArray[np.float64]:
    """Return the luminance (n,) of an environment in `sky_directions`, relative to its mean, at least 0.2.

    broad_luminance : see `EnvironmentMap`
    """
    directions = sky_directions()
    angle = np.radians(environment.rotation_degrees)
    x = np.cos(angle) * directions[:, 0] - np.sin(angle) * directions[:, 2]
    z = np.sin(angle) * directions[:, 0] + np.cos(angle) * directions[:, 2]
    height, width = broad_luminance.shape
    column = np.floor((0.5 + np.arctan2(x, -z) / (2.0 * np.pi)) * width).astype(int) % width
    row = np.minimum(np.floor(np.arccos(directions[:, 1]) / np.pi * height).astype(int), height - 1)
    found = broad_luminance[row, column].astype(np.float64)
    relative = found / max(float(found.mean()), np.finfo(np.float32).tiny)
    return np.asarray(np.maximum(relative, _MIN_SKY_LUMINANCE))


def sky_moments(sky_light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the moments (3, 4) of light from `sky_directions`, ordered as `SkyMoments` in strand_sky.wgsl.

    sky_light : (n,) light from each direction
    """
    directions = sky_directions()
    light = sky_light[:, None]
    first = np.append((light * directions).sum(axis=0), sky_light.sum())
    squares = np.append((light * directions**2).sum(axis=0), 0.0)
    mixed = np.append((light * directions * np.roll(directions, -1, axis=1)).sum(axis=0), 0.0)
    return np.stack([first, squares, mixed])


def environment_record(
    shading_program: ComputeProgram,
    environment: Environment | None,
    environment_map: EnvironmentMap,
    skin: Skin,
    albedo: NDArray[np.float64],
    has_occlusion: bool,
) -> UniformRecord:
    """Return the uniform record of the environment.

    The record holds the rotation and the exposure of the environment, and the albedo and the reflection lobes
    of the skin that the environment lights.

    shading_program : program of the shading pass, which declares the record
    environment_map : prefiltered panorama of the environment
    albedo : (3,) albedo of skin where its colour map is white [-]
    has_occlusion : whether the head hides parts of the environment from its own skin
    """
    if environment is None:
        return shading_program.make_record("Environment")
    angle = np.radians(environment.rotation_degrees)
    sky_light = sky_luminance(environment_map.broad_luminance, environment)
    return shading_program.make_record(
        "Environment",
        turn=(np.cos(angle), np.sin(angle)),
        exposure=environment.exposure,
        albedo=np.minimum(albedo, 1.0),
        occluded=int(has_occlusion),
        sky=np.column_stack([sky_directions(), sky_light]),
        sky_moments=sky_moments(sky_light),
        mirrors=isotropic_lobe_table(lobe_name(skin)).reshape(-1, 4),
    )
