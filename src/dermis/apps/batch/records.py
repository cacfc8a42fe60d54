"""Files of one image, as bytes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from dermis.apps.batch.output_encoding import encode_output, file_kind
from dermis.apps.batch.spec import Spec
from dermis.frame.observation import Landmarks, Observation
from dermis.images.codecs import encode_png

PICTURE, RECORD = "png", "json"
"""Suffixes of the picture, and of what is known of it besides its outputs."""
_PIXEL_DIGITS = 3
_MM_DIGITS = 4
_UNIT_DIGITS = 8  # of rotations and directions


def encode_record(
    number: int, observation: Observation, parameters: Mapping[str, Any], spec: Spec
) -> dict[str, bytes]:
    """The files of image `number` by suffix: equal bytes for equal arguments.

    observation : with the outputs of the spec and a picture of sRGB bytes

    png : the picture, with alpha over no background
    NAME.png, NAME.exr or NAME.npy : each output, as `encodings.stored_as` says
    json : number, parameters, camera, head_pose, gaze and landmarks
    """
    found = {PICTURE: encode_png(observation.picture, quick=True)}
    for name in spec.outputs:
        suffix = f"{name}.{file_kind(name, spec.encoding)}"
        found[suffix] = encode_output(name, observation.outputs[name], spec.encoding)
    found[RECORD] = _json(_record(number, observation, parameters, spec))
    return found


def _record(
    number: int, observation: Observation, parameters: Mapping[str, Any], spec: Spec
) -> dict[str, Any]:
    camera, gaze, found = observation.camera, observation.gaze, observation.landmarks
    named = {place: name for name, place in spec.landmark_tables.items()}  # no paths of this machine
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
        "landmarks": {named.get(place, place): _landmarks(one) for place, one in found.items()},
    }


def _landmarks(found: Landmarks) -> dict[str, Any]:
    return {
        "pixels": _rounded(found.pixels, _PIXEL_DIGITS),
        "positions_mm": _rounded(found.positions_mm, _MM_DIGITS),
        "visible": np.asarray(found.visible, bool).tolist(),
    }


def _rounded(values: ArrayLike, digits: int) -> Any:
    """Numbers as lists, null for those that are not finite; -0 is 0."""
    numbers = np.round(np.asarray(values, np.float64), digits) + 0.0
    told = numbers.astype(object)
    told[~np.isfinite(numbers)] = None
    return told.tolist()


def _json(value: Mapping[str, Any]) -> bytes:
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return f"{text}\n".encode()
