"""Rectangular lights: their irradiance, and parts with a shadow map each."""

from __future__ import annotations

import math

import numpy as np

from dermis.frame.lights.kind import Kind, Members, facing
from dermis.frame.projection import Triple, axes_of, between
from dermis.scene.lights import Light, RectangleLight

_WIDEST_PART = 0.35  # of its distance
_MOST_PARTS = 3  # along each side


class _Rectangle(Kind[RectangleLight]):
    narrow = False
    round = False

    def parts(self, light: RectangleLight) -> list[Light]:
        """Rectangles no wider or higher than 0.35 of the distance, but at most 3 x 3 of them."""
        path = between(light.position, light.target)
        distance = math.hypot(*path)
        columns, rows = (_across(side, distance) for side in (light.width_mm, light.height_mm))
        if columns == rows == 1:
            return [light]
        width, height = light.width_mm / columns, light.height_mm / rows
        right, up = map(np.array, axes_of(path)[:2])
        share = facing_irradiance(width, height, distance) / facing_irradiance(
            light.width_mm, light.height_mm, distance
        )
        moves = [
            (i - 0.5 * (columns - 1)) * width * right + (j - 0.5 * (rows - 1)) * height * up
            for j in range(rows)
            for i in range(columns)
        ]
        return [
            light.model_copy(
                update={
                    "position": tuple(light.position + move),
                    "target": tuple(light.target + move),
                    "width_mm": width,
                    "height_mm": height,
                    "irradiance": tuple(share * np.array(light.irradiance)),
                }
            )
            for move in moves
        ]

    def members(self, light: RectangleLight, centre: Triple, distance: float) -> Members:
        radiance = 1.0 / facing_irradiance(light.width_mm, light.height_mm, distance)
        return facing(light, radiance, 0.5 * light.width_mm, 0.5 * light.height_mm)


KIND = _Rectangle()


def _across(side_mm: float, distance_mm: float) -> int:
    """Parts along a side."""
    return min(max(math.ceil(side_mm / (_WIDEST_PART * distance_mm)), 1), _MOST_PARTS)


def facing_irradiance(width: float, height: float, distance: float) -> float:
    """Irradiance from a rectangle of radiance 1 on a surface opposite its middle [-].

    Source: the view factor of a corner, [Baum1989].
    """
    a, b = 0.5 * width / distance, 0.5 * height / distance
    across, along = math.hypot(1.0, a), math.hypot(1.0, b)
    return 2.0 * (a / across * math.atan(b / across) + b / along * math.atan(a / along))
