"""Light that enters the skin, on the atlas."""

from dermis.frame.features.irradiance.irradiance import fine_numbers as shader_numbers

__all__ = ["shader_numbers"]
