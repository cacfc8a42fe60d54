"""Light stage: lights in all directions, and their weights to reproduce an environment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from dermis.base.quantities import checked_integer
from dermis.scene.environment import Environment
from dermis.scene.lights import DirectionalLight

_MAX_LIGHTS = 10_000


def light_stage(count: int) -> list[DirectionalLight]:
    """Return directional lights of irradiance 1, distributed evenly over the sphere on a Fibonacci spiral.

    Raises DermisError unless the count is 1 to 10,000. Source: [Debevec2000].
    """
    count = checked_integer("light stage", count, 1, _MAX_LIGHTS, "lights")
    y = 1.0 - 2.0 * (np.arange(count) + 0.5) / count
    azimuth, radius = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count), np.sqrt(1.0 - y**2)
    towards = np.stack([radius * np.sin(azimuth), y, radius * np.cos(azimuth)], axis=-1)
    return [DirectionalLight(direction=tuple(-one), irradiance=(1.0, 1.0, 1.0)) for one in towards]


def light_stage_weights(lights: Sequence[DirectionalLight], environment: Environment) -> NDArray[np.float64]:
    """Return the weights (n, 3) of the lights of a light stage that reproduce an environment.

    The weight of a light, linear Rec. 709, is the irradiance from all directions to which this light is the
    nearest. To obtain the picture under the environment, multiply the picture under each light by the light's
    weight, and add the products.

    Raises DermisError when the panorama cannot be read.
    """
    from dermis.environment.panorama import load_panorama, texel_directions, texel_solid_angles

    radiance = load_panorama(environment.name)
    size = radiance.shape[0], radiance.shape[1]
    texel_irradiance = environment.exposure * radiance * texel_solid_angles(*size)[..., None]
    angle = np.radians(environment.rotation_degrees)
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y, z = np.moveaxis(texel_directions(*size).reshape(-1, 3), -1, 0)
    rotated = np.stack([cosine * x + sine * z, y, cosine * z - sine * x], axis=-1)
    towards = -np.array([light.direction for light in lights], dtype=np.float64)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    nearest = (rotated @ towards.T).argmax(axis=1)
    sums = [np.bincount(nearest, texel_irradiance[..., c].ravel(), len(lights)) for c in range(3)]
    return np.stack(sums, axis=-1)
