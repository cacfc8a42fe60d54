"""dlib's face detector (histograms of oriented gradients) and its 68 landmarks."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from dermis.apps.validation.detectors.detection import Detection
from dermis.base.arrays import Bytes

_DEBIAN_WEIGHTS = Path("/usr/share/dlib/shape_predictor_68_face_landmarks.dat")


class Dlib:
    """Face detector with the 68 landmarks of 300-W.

    weights : file shape_predictor_68_face_landmarks.dat
    """

    name, landmark_set = "dlib (HOG, 68 landmarks)", "ibug-68"
    licence = "trained on 300-W: no commercial use"
    normaliser = "36", "45"

    def __init__(self, weights: Path) -> None:
        dlib = import_module("dlib")
        self._find, self._place = dlib.get_frontal_face_detector(), dlib.shape_predictor(str(weights))

    @staticmethod
    def default_weights() -> Path | None:
        """Return the weights of Debian's package libdlib-data; None if they or dlib are missing."""
        return _DEBIAN_WEIGHTS if find_spec("dlib") and _DEBIAN_WEIGHTS.is_file() else None

    def detect(self, picture: Bytes) -> Detection | None:
        """Return the largest face in a picture (h, w, 3); None if no face is found."""
        found = max(self._find(picture, 1), key=lambda box: box.area(), default=None)
        if found is None:
            return None
        shape = self._place(picture, found)
        points = {str(k): np.array([part.x, part.y], np.float64) for k, part in enumerate(shape.parts())}
        return Detection((found.left(), found.top(), found.right(), found.bottom()), points)
