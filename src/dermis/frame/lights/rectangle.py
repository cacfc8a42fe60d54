"""Rectangular lights, which are divided into parts, each with its own shadow map."""

from __future__ import annotations

import math

import numpy as np

from dermis.frame.lights.kind import LightKind, StructMembers, area_light_members
from dermis.frame.projection import Triple, vector_between, view_axes
from dermis.scene.lights import Light, RectangleLight

_MAX_PART_SIDE_PER_DISTANCE = 0.35  # largest ratio of a part's side to the light's distance from its target
_MAX_PARTS_PER_SIDE = 3  # largest number of parts along each side


class _RectangleLightKind(LightKind[RectangleLight]):
    punctual = False
    round = False

    def light_parts(self, light: RectangleLight) -> list[Light]:
        """Divide the rectangle into parts whose sides are at most 0.35 of the distance from light to target.

        There are at most 3 parts along each side, even if their sides then exceed this limit.
        """
        path = vector_between(light.position, light.target)
        distance = math.hypot(*path)
        columns, rows = (_part_count(side, distance) for side in (light.width_mm, light.height_mm))
        if columns == rows == 1:
            return [light]
        width, height = light.width_mm / columns, light.height_mm / rows
        right, up = map(np.array, view_axes(path)[:2])
        fraction = facing_irradiance(width, height, distance) / facing_irradiance(
            light.width_mm, light.height_mm, distance
        )
        offsets = [
            (i - 0.5 * (columns - 1)) * width * right + (j - 0.5 * (rows - 1)) * height * up
            for j in range(rows)
            for i in range(columns)
        ]
        return [
            light.model_copy(
                update={
                    "position": tuple(light.position + offset),
                    "target": tuple(light.target + offset),
                    "width_mm": width,
                    "height_mm": height,
                    "irradiance": tuple(fraction * np.array(light.irradiance)),
                }
            )
            for offset in offsets
        ]

    def shader_members(
        self, light: RectangleLight, head_centre: Triple, target_distance: float
    ) -> StructMembers:
        radiance = 1.0 / facing_irradiance(light.width_mm, light.height_mm, target_distance)
        return area_light_members(light, radiance, 0.5 * light.width_mm, 0.5 * light.height_mm)


KIND = _RectangleLightKind()


def _part_count(side_mm: float, distance_mm: float) -> int:
    """Return the number of parts into which a rectangular light is divided along one side.

    side_mm : length of the side [mm]
    distance_mm : distance from the light to its target [mm]
    """
    return min(max(math.ceil(side_mm / (_MAX_PART_SIDE_PER_DISTANCE * distance_mm)), 1), _MAX_PARTS_PER_SIDE)


def facing_irradiance(width_mm: float, height_mm: float, distance_mm: float) -> float:
    """Return the irradiance at a point opposite the centre of a rectangle of radiance 1 [-].

    width_mm, height_mm : sides of the rectangle [mm]
    distance_mm : distance of the point from the centre [mm]

    Source: [Baum1989] for a point opposite the corner of a rectangle, applied to the four quarters of this
    rectangle.
    """
    a, b = 0.5 * width_mm / distance_mm, 0.5 * height_mm / distance_mm
    across, along = math.hypot(1.0, a), math.hypot(1.0, b)
    return 2.0 * (a / across * math.atan(b / across) + b / along * math.atan(a / along))
