"""Last steps of rendered observations: background pictures, sRGB of blurred pictures, and the sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.apps.batch.backdrops import with_backdrop
from dermis.apps.batch.image_facts import ImageFacts
from dermis.apps.batch.observed_photographs import as_photograph
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.spec import Spec
from dermis.base.arrays import Bytes, Floats
from dermis.frame.observation import Observation
from dermis.images.colour import encode_srgb8


def finished_image(
    observation: Observation, parameters: Parameters, facts: ImageFacts, spec: Spec
) -> tuple[Observation, ImageFacts]:
    """Return the observation to store for an image, and the facts for its record.

    observation : observation from `observe_images`
    parameters : sampled parameters of the image
    """
    observation = with_backdrop(observation, parameters, spec)
    if spec.sensor is not None:
        return as_photograph(observation, parameters, facts)
    if observation.picture.dtype == np.uint8:
        return observation, facts
    return replace(observation, picture=_srgb_bytes(np.asarray(observation.picture))), facts


def _srgb_bytes(picture: Floats) -> Bytes:
    """Return a linear picture as sRGB bytes; colours that are premultiplied by alpha are divided by it."""
    if picture.shape[2] == 3:
        return encode_srgb8(picture)
    alpha = picture[..., 3:]
    colours = encode_srgb8(picture[..., :3] / np.maximum(alpha, np.float32(1e-6)))
    return np.concatenate([colours, np.rint(255.0 * alpha).astype(np.uint8)], axis=2)
