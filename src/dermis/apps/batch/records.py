"""Files of one image, as bytes."""

from __future__ import annotations

import json
from typing import TypedDict, Union

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.batch.output_encoding import encode_output, file_format
from dermis.apps.batch.sampling import Parameters
from dermis.apps.batch.spec import Spec
from dermis.frame.observation import Observation
from dermis.images.codecs import encode_png

PICTURE, RECORD = "png", "json"
"""Suffixes of the picture, and of the record of all other ground truth besides the outputs."""
Numbers = list[Union["Numbers", float, None]]
"""Numbers of an array; null where one is not finite."""
_PIXEL_DIGITS = 3
_MM_DIGITS = 4
_UNIT_DIGITS = 8  # of rotations and directions


class CameraRecord(TypedDict):
    """Camera of OpenCV: K (R X + t)."""

    K: Numbers
    R: Numbers
    t: Numbers


class LandmarksRecord(TypedDict):
    """Landmarks of an image, see `reader.LandmarkPoints`."""

    pixels: Numbers
    positions_mm: Numbers
    visible: list[bool]


class Record(TypedDict):
    """Content of the JSON file of an image."""

    number: int
    parameters: Parameters
    camera: CameraRecord
    head_pose: Numbers
    gaze: Numbers | None
    landmarks: dict[str, LandmarksRecord]


def encode_record(
    number: int, observation: Observation, parameters: Parameters, spec: Spec
) -> dict[str, bytes]:
    """Return the files of image `number` by suffix: equal bytes for equal arguments.

    observation : with the outputs of the spec and a picture of sRGB bytes

    png : the picture, with alpha over no background
    NAME.png, NAME.exr or NAME.npy : each output, see `output_encoding.storage_description`
    json : the `Record`
    """
    found = {PICTURE: encode_png(observation.picture, quick=True)}
    for name in spec.outputs:
        suffix = f"{name}.{file_format(name, spec.encoding)}"
        found[suffix] = encode_output(name, observation.outputs[name], spec.encoding)
    record = _record(number, observation, parameters, spec)
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    found[RECORD] = f"{text}\n".encode()
    return found


def _record(number: int, observation: Observation, parameters: Parameters, spec: Spec) -> Record:
    camera, gaze = observation.camera, observation.gaze
    names = {path: name for name, path in spec.landmark_tables.items()}  # no paths of this machine
    return {
        "number": number,
        "parameters": dict(parameters),
        "camera": {
            "K": _rounded(camera.K, _MM_DIGITS),
            "R": _rounded(camera.R, _UNIT_DIGITS),
            "t": _rounded(camera.t, _MM_DIGITS),
        },
        "head_pose": _rounded(observation.head_pose, _UNIT_DIGITS),
        "gaze": None if gaze is None else _rounded(gaze, _UNIT_DIGITS),
        "landmarks": {
            names.get(path, path): {
                "pixels": _rounded(one.pixels, _PIXEL_DIGITS),
                "positions_mm": _rounded(one.positions_mm, _MM_DIGITS),
                "visible": np.asarray(one.visible, bool).tolist(),
            }
            for path, one in observation.landmarks.items()
        },
    }


def _rounded(values: ArrayLike, digits: int) -> Numbers:
    """Return numbers as nested lists, null for those that are not finite; -0 is 0."""
    numbers = np.round(np.asarray(values, np.float64), digits) + 0.0
    found = numbers.astype(object)
    found[~np.isfinite(numbers)] = None
    return list(found.tolist())
