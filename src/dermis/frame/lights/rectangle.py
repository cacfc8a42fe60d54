"""Rectangular lights: their irradiance, and parts with a shadow map each."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.frame.lights.kind import Kind, facing
from dermis.frame.projection import Triple, frame_of
from dermis.scene.lights import Light, RectangleLight

Floats = NDArray[np.float64]
_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_UP = np.array([0.0, 1.0, 0.0])
_WIDEST_PART = 0.35  # of its distance
_MOST_PARTS = 3  # along each side


class _Rectangle(Kind[RectangleLight]):
    narrow = False
    round = False

    def parts(self, light: RectangleLight) -> list[Light]:
        """Rectangles no wider or higher than 0.35 of the distance, but at most 3 x 3 of them."""
        path = np.subtract(light.target, light.position)
        right, up, _ = frame_of(path, _UP)
        sides, distance = np.array([light.width_mm, light.height_mm]), float(np.linalg.norm(path))
        columns, rows = np.clip(np.ceil(sides / (_WIDEST_PART * distance)), 1, _MOST_PARTS).astype(int)
        width, height = sides / (columns, rows)
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
                    "width_mm": float(width),
                    "height_mm": float(height),
                    "irradiance": tuple(share * np.array(light.irradiance)),
                }
            )
            for move in moves
        ]

    def members(self, light: RectangleLight, centre: Triple, distance: float) -> dict[str, Any]:
        radiance = 1.0 / facing_irradiance(light.width_mm, light.height_mm, distance)
        return facing(light, radiance, 0.5 * light.width_mm, 0.5 * light.height_mm)


KIND = _Rectangle()


def rectangle_irradiance(corners: Floats, normal: Floats) -> float:
    """Irradiance from a uniform polygon of radiance 1 on a surface at the origin that sees all of it [-].

    corners : (k, 3) in order around the polygon
    normal : (3,) of the surface

    Source: Lambert's formula, as in [Baum1989].
    """
    unit = corners / np.linalg.norm(corners, axis=1, keepdims=True)
    after = np.roll(unit, -1, axis=0)
    edge = np.cross(unit, after)
    angle = np.arctan2(np.linalg.norm(edge, axis=1), (unit * after).sum(axis=1))
    edge /= np.linalg.norm(edge, axis=1, keepdims=True)
    return abs(0.5 * float((angle * (edge @ normal)).sum()))


def facing_irradiance(width: float, height: float, distance: float) -> float:
    """Irradiance from a rectangle of radiance 1 on a surface opposite its middle [-]."""
    corners = np.array(_CORNERS) * (0.5 * width, 0.5 * height)
    return rectangle_irradiance(np.column_stack([corners, np.full(4, distance)]), np.array([0.0, 0.0, 1.0]))
