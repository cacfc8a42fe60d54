"""Lights of the frame: a module and a shader for each kind of light, and their common records."""

from dermis.frame.lights.records import (
    light_constants,
    light_part_counts,
    light_records,
    light_shader_constants,
    light_views,
    sun_lights,
)

__all__ = [
    "light_constants",
    "light_shader_constants",
    "light_part_counts",
    "light_records",
    "light_views",
    "sun_lights",
]
