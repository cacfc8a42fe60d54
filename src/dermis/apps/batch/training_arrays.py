"""Conversion of images of data sets to NumPy arrays with fixed keys, types and shapes, for batches."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.batch.face_boxes import BOX_NAMES
from dermis.apps.batch.image_facts import SPLIT_NAMES, fact_names, text_fact_names
from dermis.apps.batch.reader import FIELDS_WITHOUT_OUTPUTS, ImageFields
from dermis.apps.batch.spec import Spec

ImageArrays = dict[str, NDArray[Any]]
_OPAQUE = 255
_UNKNOWN = -1  # split or person that an image does not state
_SKIN_TONE_NUMBERS = "L", "a", "b", "hue_degrees", "ita_degrees"


def parameter_names(spec: Spec) -> tuple[str, ...]:
    """Return the names of the numbers in the array "parameters" of `arrays` and `stream`, in order.

    Parameters
    ----------
    spec : Spec
        Spec of the data set.

    Returns
    -------
    tuple of str
        Sorted names, such as "camera.yaw_deg" and "person.age"; parameters with strings are omitted.

    Examples
    --------
    >>> from dermis.dataset import parameter_names, parse_spec
    >>> "person.age" in parameter_names(parse_spec({}))
    True
    """
    names = {*spec.parameter_names, *fact_names(spec)} - text_fact_names()
    texts = {
        name
        for name, distribution in spec.distributions.items()
        if any(isinstance(bound, str) for bound in distribution.support)
    }
    return tuple(sorted(names - texts))


def arrays(image: ImageFields) -> ImageArrays:
    """Return an image as arrays with the same keys, types and shapes for all images of a data set.

    Parameters
    ----------
    image : dict
        Image as `read_dataset` yields it.

    Returns
    -------
    dict of ndarray
        "number" and "person", numbers of the image and of the person; "split" (0 train, 1 val, 2 test);
        "picture" (h, w, 3) and "picture_alpha" (h, w), bytes; the outputs by their names; "camera.K",
        "camera.R", "camera.t", "head_pose", "gaze", "gaze_error_deg"; "box.face", "box.head", "box.detector"
        (left, upper, right, lower edge [pixel]); "skin_tone" (L, a, b, hue and ITA in degrees); "parameters",
        numbers in the order of `parameter_names`; and for each landmark set "landmarks.SET.pixels",
        ".positions_mm", ".visible" and ".occlusion". Floats are float32, with NaN for values that the image
        does not have. An unknown split or person is -1.

    Examples
    --------
    >>> import numpy as np, dermis.dataset
    >>> camera = dermis.Camera(position=(0, 0, 600), target=(0, 0, 0)).to_opencv((4, 2))
    >>> image = {"number": 3, "picture": np.zeros((2, 4, 3), np.uint8), "parameters": {"camera.yaw_deg": 5.0}}
    >>> image |= {"camera": camera, "head_pose": np.eye(3, 4), "gaze": None, "landmarks": {}}
    >>> dermis.dataset.arrays(image)["gaze"].shape
    (2, 3)
    """
    picture, parameters = image["picture"], image["parameters"]
    height, width = picture.shape[:2]
    has_alpha = picture.shape[2] == 4
    alpha = picture[..., 3].copy() if has_alpha else np.full((height, width), _OPAQUE, np.uint8)
    boxes = image.get("boxes") or {}
    split = SPLIT_NAMES.index(image["split"]) if image.get("split") else _UNKNOWN
    tone = image.get("skin_tone") or {}
    result: ImageArrays = {
        "number": np.array(image["number"], np.int64),
        "person": np.array(parameters.get("person.number", _UNKNOWN), np.int64),
        "split": np.array(split, np.int64),
        "picture": np.ascontiguousarray(picture[..., :3]),
        "picture_alpha": alpha,
        **{name: np.array(value) for name, value in image.items() if name not in FIELDS_WITHOUT_OUTPUTS},
        **{f"camera.{name}": _floats(getattr(image["camera"], name)) for name in ("K", "R", "t")},
        "head_pose": _floats(image["head_pose"]),
        "gaze": _floats(image["gaze"], (2, 3)),
        "gaze_error_deg": _floats(image.get("gaze_error_deg"), (2,)),
        **{f"box.{name}": _floats(boxes.get(name), (4,)) for name in BOX_NAMES},
        "skin_tone": _floats([tone.get(name, np.nan) for name in _SKIN_TONE_NUMBERS]),
        "parameters": _parameter_vector(parameters),
    }
    for name, points in image["landmarks"].items():
        result[f"landmarks.{name}.pixels"] = _floats(points.pixels)
        result[f"landmarks.{name}.positions_mm"] = _floats(points.positions_mm)
        result[f"landmarks.{name}.visible"] = np.array(points.visible)
        result[f"landmarks.{name}.occlusion"] = np.array(points.occlusion)
    return result


def _parameter_vector(parameters: Mapping[str, float | int | str | None]) -> NDArray[np.float32]:
    texts = text_fact_names()
    numbers = {
        name: value for name, value in parameters.items() if not isinstance(value, str) and name not in texts
    }
    return _floats([np.nan if numbers[name] is None else numbers[name] for name in sorted(numbers)])


def _floats(values: object, missing_shape: tuple[int, ...] = ()) -> NDArray[np.float32]:
    """Return values as a new float32 array; for None, an array of NaN with the shape `missing_shape`."""
    if values is None:
        return np.full(missing_shape, np.nan, np.float32)
    return np.array(values, np.float32)
