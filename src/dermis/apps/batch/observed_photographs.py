"""Photographs of observations: the model of the sensor, applied to the linear pictures of a renderer."""

from __future__ import annotations

from dataclasses import replace

from dermis.apps.batch.image_facts import SENSOR_FACT_NAMES, ImageFacts
from dermis.apps.batch.output_encoding import LINEAR_PICTURE
from dermis.apps.batch.sampling import Parameters, round_significant
from dermis.apps.batch.sensor.model import Sensor
from dermis.apps.batch.sensor.photograph import photograph
from dermis.apps.batch.spec_tables import table_values
from dermis.frame.observation import Observation


def as_photograph(
    observation: Observation, parameters: Parameters, facts: ImageFacts
) -> tuple[Observation, ImageFacts]:
    """Return an observation with the picture that a camera stores, and the facts with those of the exposure.

    The linear picture becomes the output "linear" of the observation.

    observation : observation with a linear picture
    parameters : sampled parameters of the image, with those of the table [sensor]
    """
    values = table_values(parameters, "sensor")
    photo = photograph(
        observation.picture,
        Sensor.model_validate({name: values[name] for name in Sensor.model_fields if name in values}),
        K=observation.camera.K,
        light_colour=facts.light_colour,
        seed=int(values.get("seed", 0)),
    )
    numbers = map(round_significant, (*photo.white, photo.clipped_fraction))
    outputs = {**observation.outputs, LINEAR_PICTURE: observation.picture}
    return (
        replace(observation, picture=photo.picture, outputs=outputs),
        replace(facts, sensor=dict(zip(SENSOR_FACT_NAMES, numbers, strict=True))),
    )
