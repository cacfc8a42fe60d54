"""How finely a head is subdivided for a picture."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from dermis.base.errors import refuse
from dermis.mesh.head import Head
from dermis.mesh.silhouette import MOST_TRIANGLES, silhouette, smooth_levels
from dermis.mesh.subdivide import MAX_LEVELS
from dermis.scene.camera import Camera, portrait
from dermis.scene.head_table import AUTO


@dataclass(frozen=True)
class SmoothIn:
    """As many levels of subdivision as a head's outline needs to look smooth in a picture.

    camera : from where the head, as it comes, is seen
    size : of the picture [pixel]

    For `subdivide` of `load_head`. It depends on nothing but these and the head at rest.
    """

    camera: Callable[[Head], Camera] = portrait
    size: tuple[int, int] = (1024, 1024)

    def __call__(self, head: Head) -> int:
        """The levels, 0 to 3, which do not lead to more than `MOST_TRIANGLES` triangles."""
        triangles = len(head.mesh.triangles)
        if 4 * triangles > MOST_TRIANGLES:
            return 0
        K, R, t = self.camera(head).to_opencv(self.size)
        seen = silhouette(head.mesh, K, R, t - R @ np.array(head.centre_mm), self.size)
        return smooth_levels(seen.coarseness_px, triangles)


Levels = int | Callable[[Head], int]
Subdivide = Levels | Literal["auto"]
"""Levels of subdivision, "auto" for a portrait of 1024x1024, or a function of the head as it comes."""


def chosen_levels(subdivide: Subdivide) -> Levels:
    """Levels, or the function that finds them.

    Raises DermisError for other words.
    """
    if subdivide == AUTO:
        return SmoothIn()
    if isinstance(subdivide, str):
        refuse("subdivide", f"{AUTO} or 0 to {MAX_LEVELS} levels", f"{subdivide!r} came", "Choose one")
    return subdivide
