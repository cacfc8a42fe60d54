"""Photographs of observations: the models of lens and sensor, applied to linear pictures of a renderer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from dermis.apps.batch.cameras import sampled_lens
from dermis.apps.batch.image_facts import SENSOR_FACT_NAMES, ImageFacts
from dermis.apps.batch.output_encoding import LINEAR_PICTURE, half_precision
from dermis.apps.batch.records import MM_DECIMALS
from dermis.apps.batch.sampling import Parameters, round_significant
from dermis.apps.batch.sensor.lens import Lens, to_pixels, to_plane
from dermis.apps.batch.sensor.model import Sensor
from dermis.apps.batch.sensor.photograph import photograph
from dermis.apps.batch.sensor.warping import Neighbours, find_neighbours, sample_bilinear, sample_nearest
from dermis.apps.batch.spec import Spec
from dermis.apps.batch.spec_tables import table_values
from dermis.base.arrays import Doubles, Floats
from dermis.frame.features.outputs.output_images import OutputArray
from dermis.frame.features.post.background import studio_backdrop
from dermis.frame.observation import Landmarks, Observation

_CLASS_OUTPUTS = "label", "label_amodal"
"""Outputs that divide the picture into surfaces, across which outputs are not interpolated."""
_NEAREST_OUTPUTS = "uv", "barycentric", "normal_geometric"
"""Outputs of floats that differ between triangles or charts of one surface."""
_COVERAGE_OUTPUTS = "alpha", "hair_alpha"
"""Outputs that are interpolated across edges."""
_COVERAGE_OUTPUT = "alpha"  # coverage by head and hair, with which the background is blended
_OUTSIDE = 2  # occlusion of landmarks outside the picture


def rendered_outputs(spec: Spec) -> tuple[str, ...]:
    """Return the outputs to render for the images of a spec: its own, and those that photographs need."""
    coverage = (_COVERAGE_OUTPUT,) if spec.sensor is not None else ()
    classes = _CLASS_OUTPUTS if spec.lens is not None else ()
    return tuple(dict.fromkeys((*spec.outputs, *coverage, *classes)))


def as_photograph(
    observation: Observation, parameters: Parameters, facts: ImageFacts
) -> tuple[Observation, ImageFacts]:
    """Return an observation with the picture that a camera stores, and the facts with those of the exposure.

    The linear picture becomes the output "linear" of the observation. It is rounded to 16-bit floats, and the
    camera to the decimals of records, so that the files of an image reproduce its photograph exactly.

    Backgrounds of the kinds "gradient" and "colour", which emit no light, are coloured by the lights.

    observation : observation with a linear picture, and the outputs of `rendered_outputs`
    parameters : sampled parameters of the image, with those of the table [sensor]
    """
    light, lens = facts.light_colour or (1.0, 1.0, 1.0), sampled_lens(parameters)
    observation = replace(observation, picture=_with_lit_background(observation, parameters, light))
    if lens is not None:
        assert facts.picture_K is not None
        observation = through_lens(observation, lens, facts.picture_K)
    values, linear = table_values(parameters, "sensor"), half_precision(observation.picture)
    photo = photograph(
        linear,
        Sensor.model_validate({name: values[name] for name in Sensor.model_fields if name in values}),
        K=np.round(observation.camera.K, MM_DECIMALS),
        light_colour=facts.light_colour,
        seed=int(values.get("seed", 0)),
    )
    numbers = map(round_significant, (*light, *photo.white, photo.clipped_fraction))
    outputs = {**observation.outputs, LINEAR_PICTURE: linear}
    return (
        replace(observation, picture=photo.picture, outputs=outputs),
        replace(facts, sensor=dict(zip(SENSOR_FACT_NAMES, numbers, strict=True))),
    )


def _with_lit_background(
    observation: Observation, parameters: Parameters, light_colour: tuple[float, float, float]
) -> Floats:
    """Return the linear picture with its background multiplied by the colour of the lights."""
    picture = np.asarray(observation.picture, np.float32)
    tint = np.array(light_colour, np.float32) - np.float32(1.0)
    kind = parameters["background.kind"]
    if kind == "colour":
        channels = (float(parameters[f"background.{one}"]) for one in ("red", "green", "blue"))
        background = np.array(list(channels), np.float32)
    elif kind == "gradient":
        background = studio_backdrop((picture.shape[1], picture.shape[0]))
    else:
        return picture
    uncovered = 1.0 - observation.outputs[_COVERAGE_OUTPUT][..., None]
    return np.asarray(picture + uncovered * background * tint, np.float32)


def through_lens(observation: Observation, lens: Lens, picture_K: Doubles) -> Observation:
    """Return picture, outputs and landmarks as a lens images them, with the camera without its distortion.

    observation : observation of a pinhole camera that shows all that the lens shows, with the outputs of
        `rendered_outputs`
    picture_K : intrinsic matrix (3, 3) of the new picture [pixel]
    """
    height, width = observation.picture.shape[:2]
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), axis=-1)
    pinhole_K, outputs = observation.camera.K, observation.outputs
    neighbours = find_neighbours(to_pixels(lens.undistort(to_plane(grid, picture_K)), pinhole_K))
    classes = outputs["label"].astype(np.int64) << 8 | outputs["label_amodal"]
    return replace(
        observation,
        picture=sample_bilinear(observation.picture, neighbours),
        outputs={name: _warped_output(name, one, neighbours, classes) for name, one in outputs.items()},
        camera=observation.camera._replace(K=picture_K),
        landmarks={
            name: _warped_landmarks(one, lens, pinhole_K, picture_K, (width, height))
            for name, one in observation.landmarks.items()
        },
    )


def _warped_output(
    name: str, values: OutputArray, neighbours: Neighbours, classes: OutputArray
) -> OutputArray:
    if values.dtype.kind in "iu" or name in _NEAREST_OUTPUTS:
        return sample_nearest(values, neighbours)
    if name in _COVERAGE_OUTPUTS:
        return sample_bilinear(values, neighbours)
    warped = sample_bilinear(values, neighbours, classes)
    if name.startswith("normal"):
        lengths = np.linalg.norm(warped, axis=-1, keepdims=True)
        warped = warped / np.where(lengths > 0.0, lengths, 1.0)
    return warped


def _warped_landmarks(
    landmarks: Landmarks, lens: Lens, pinhole_K: Doubles, picture_K: Doubles, size: tuple[int, int]
) -> Landmarks:
    """Return landmarks at their pixels behind the lens; NaN where the lens images no point."""
    pixels = to_pixels(lens.distort(to_plane(landmarks.pixels, pinhole_K)), picture_K)
    inside = ((pixels >= -0.5) & (pixels <= np.array(size) - 0.5)).all(axis=1)
    occlusion = np.where(inside, landmarks.occlusion, _OUTSIDE).astype(np.uint8)
    return landmarks._replace(pixels=pixels, occlusion=occlusion)
