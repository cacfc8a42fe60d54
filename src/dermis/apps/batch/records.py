"""Encoding of an image of a data set: its picture, its output arrays and its JSON record."""

from __future__ import annotations

import json
from typing import NotRequired, TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.batch.image_facts import ImageFacts, image_split, record_parameters
from dermis.apps.batch.licences import image_licence
from dermis.apps.batch.output_encoding import (
    LINEAR_PICTURE,
    encode_linear_picture,
    encode_output,
    file_format,
)
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.spec import Spec
from dermis.frame.observation import Observation
from dermis.images.codecs import encode_png
from dermis.images.skin_tone import SkinTone
from dermis.scene.opencv import OpenCvCamera

PICTURE_SUFFIX, RECORD_SUFFIX = "png", "json"
"""File name suffixes of the picture and of the record."""
NestedNumbers = list[Union["NestedNumbers", float, None]]
"""Array as nested lists; null where a number is not finite."""
_PIXEL_DECIMALS = 3
MM_DECIMALS = 4
"""Decimals of lengths and of the camera's intrinsic matrix in records."""
_DIRECTION_DECIMALS = 8  # rotations and directions
_DEGREE_DECIMALS = 3
_NO_FACTS = ImageFacts()


class CameraRecord(TypedDict):
    """Camera in OpenCV's convention: K (R X + t) are homogeneous pixel coordinates of a point X [mm]."""

    K: NestedNumbers
    R: NestedNumbers
    t: NestedNumbers


class LandmarksRecord(TypedDict):
    """Landmarks of an image as JSON lists; `reader.LandmarkPoints` describes the fields."""

    pixels: NestedNumbers
    positions_mm: NestedNumbers
    visible: list[bool]
    occlusion: NestedNumbers


class Record(TypedDict):
    """Description of one image as stored in its JSON file, with the same keys for all images of a data set.

    For `head_pose` and `gaze`, see `Observation`; for `gaze_error_deg` and `boxes`, see `ImageFacts`. `split`
    is "train", "val" or "test", by person. `rig` has all cameras of a spec with [rig] by name.
    """

    number: int
    split: str
    licence: str
    parameters: dict[str, float | int | str | None]
    skin_tone: dict[str, float | int | str] | None
    camera: CameraRecord
    rig: NotRequired[dict[str, CameraRecord]]
    head_pose: NestedNumbers
    gaze: NestedNumbers | None
    gaze_error_deg: NestedNumbers | None
    boxes: dict[str, NestedNumbers] | None
    landmarks: dict[str, LandmarksRecord]


def encode_record(
    image_number: int,
    observation: Observation,
    parameters: Parameters,
    spec: Spec,
    skin_tone: SkinTone | None = None,
    facts: ImageFacts = _NO_FACTS,
) -> dict[str, bytes]:
    """Return the bytes of the files of image `image_number`, by file suffix.

    observation : sRGB picture and output arrays of the image
    parameters : sampled parameters of the image
    skin_tone : description of the colour of the skin; None if this colour is unknown
    facts : properties of the person, gaze errors and boxes

    The suffixes are "png" for the picture, with an alpha channel if the picture has no background;
    "NAME.png", "NAME.exr" or "NAME.npy" for each output, see `output_encoding.storage_description`;
    "linear.exr" for the linear picture, if the spec keeps it; and "json" for the `Record`. Equal arguments
    give identical bytes.
    """
    files = {PICTURE_SUFFIX: encode_png(observation.picture, use_isal=True)}
    for name in spec.stored_outputs:
        suffix = f"{name}.{file_format(name, spec.encoding)}"
        files[suffix] = encode_output(name, observation.outputs[name], spec.encoding)
    if spec.keep_linear:
        files[f"{LINEAR_PICTURE}.exr"] = encode_linear_picture(observation.outputs[LINEAR_PICTURE])
    record = make_record(image_number, observation, parameters, spec, skin_tone, facts)
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    files[RECORD_SUFFIX] = f"{text}\n".encode()
    return files


def make_record(
    image_number: int,
    observation: Observation,
    parameters: Parameters,
    spec: Spec,
    skin_tone: SkinTone | None,
    facts: ImageFacts,
) -> Record:
    """Return the record of an image; the arguments are those of `encode_record`."""
    camera, gaze, errors, boxes = observation.camera, observation.gaze, facts.gaze_error_deg, facts.boxes
    names = {path: name for name, path in spec.landmark_tables.items()}  # records hold no absolute paths
    return {
        "number": image_number,
        "split": image_split(spec, parameters),
        "licence": image_licence(parameters),
        "parameters": record_parameters(
            spec, {**parameters, **facts.captured}, {**facts.person, **facts.sensor, **facts.blur}
        ),
        "skin_tone": None if skin_tone is None else skin_tone.as_json(),
        "camera": _camera_record(camera),
        **({"rig": {name: _camera_record(one) for name, one in facts.rig.items()}} if facts.rig else {}),  # type: ignore[typeddict-item]
        "head_pose": _rounded_list(observation.head_pose, _DIRECTION_DECIMALS),
        "gaze": None if gaze is None else _rounded_list(gaze, _DIRECTION_DECIMALS),
        "gaze_error_deg": None if errors is None else _rounded_list(errors, _DEGREE_DECIMALS),
        "boxes": None
        if boxes is None
        else {name: _rounded_list(box, _PIXEL_DECIMALS) for name, box in boxes.items()},
        "landmarks": {
            names.get(path, path): {
                "pixels": _rounded_list(one.pixels, _PIXEL_DECIMALS),
                "positions_mm": _rounded_list(one.positions_mm, MM_DECIMALS),
                "visible": np.asarray(one.visible, bool).tolist(),
                "occlusion": one.occlusion.tolist(),
            }
            for path, one in observation.landmarks.items()
        },
    }


def _camera_record(camera: OpenCvCamera) -> CameraRecord:
    return {
        "K": _rounded_list(camera.K, MM_DECIMALS),
        "R": _rounded_list(camera.R, _DIRECTION_DECIMALS),
        "t": _rounded_list(camera.t, MM_DECIMALS),
    }


def _rounded_list(number_array: ArrayLike, decimal_digits: int) -> NestedNumbers:
    """Return rounded numbers as nested lists, with null for numbers that are not finite and 0 for -0."""
    numbers = np.round(np.asarray(number_array, np.float64), decimal_digits) + 0.0
    nullable = numbers.astype(object)
    nullable[~np.isfinite(numbers)] = None
    return list(nullable.tolist())
