"""Photographs of observations: the model of the sensor, applied to the linear pictures of a renderer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.apps.batch.image_facts import SENSOR_FACT_NAMES, ImageFacts
from dermis.apps.batch.output_encoding import LINEAR_PICTURE, half_precision
from dermis.apps.batch.records import MM_DECIMALS
from dermis.apps.batch.sampling import Parameters, round_significant
from dermis.apps.batch.sensor.model import Sensor
from dermis.apps.batch.sensor.photograph import photograph
from dermis.apps.batch.spec_tables import table_values
from dermis.frame.observation import Observation


def as_photograph(
    observation: Observation, parameters: Parameters, facts: ImageFacts
) -> tuple[Observation, ImageFacts]:
    """Return an observation with the picture that a camera stores, and the facts with those of the exposure.

    The linear picture becomes the output "linear" of the observation. It is rounded to 16-bit floats, and the
    camera to the decimals of records, so that the files of an image reproduce its photograph exactly.

    observation : observation with a linear picture
    parameters : sampled parameters of the image, with those of the table [sensor]
    """
    values, linear = table_values(parameters, "sensor"), half_precision(observation.picture)
    photo = photograph(
        linear,
        Sensor.model_validate({name: values[name] for name in Sensor.model_fields if name in values}),
        K=np.round(observation.camera.K, MM_DECIMALS),
        light_colour=facts.light_colour,
        seed=int(values.get("seed", 0)),
    )
    light = facts.light_colour or (1.0, 1.0, 1.0)
    numbers = map(round_significant, (*light, *photo.white, photo.clipped_fraction))
    outputs = {**observation.outputs, LINEAR_PICTURE: linear}
    return (
        replace(observation, picture=photo.picture, outputs=outputs),
        replace(facts, sensor=dict(zip(SENSOR_FACT_NAMES, numbers, strict=True))),
    )
