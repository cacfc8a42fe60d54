"""Irradiance at the texels of the atlas, by light that enters the skin."""

from dermis.frame.features.irradiance.irradiance import fine_light_constants as shader_constants

__all__ = ["shader_constants"]
