"""Result of a face detector in a picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from dermis.base.arrays import Bytes, Doubles


class Detection(NamedTuple):
    """Face in a picture.

    box : left, upper, right and lower edge [pixel]
    points : (2,) position of each landmark by its name in the landmark set of this package [pixel]
    """

    box: tuple[float, ...]
    points: Mapping[str, Doubles]


class Detector(Protocol):
    """Face detector that also finds landmarks.

    name : name in the report
    landmark_set : landmark set of this package with the same points
    licence : licence of the weights
    normaliser : names of the outer corners of the eyes, whose distance normalises errors
    """

    name: str
    landmark_set: str
    licence: str
    normaliser: tuple[str, str]

    def detect(self, picture: Bytes) -> Detection | None:
        """Return the most prominent face in a picture (h, w, 3); None if no face is found."""
        ...
