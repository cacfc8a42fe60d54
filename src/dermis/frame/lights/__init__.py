"""Lights as the frame draws them: a file and a shader for each kind, and what all kinds share."""

from dermis.frame.lights.records import (
    light_constants,
    light_numbers,
    light_parts,
    light_records,
    light_views,
    sun_lights,
)

__all__ = ["light_constants", "light_numbers", "light_parts", "light_records", "light_views", "sun_lights"]
