"""Irradiance of the light that enters the skin, at each texel of the atlas."""

from dermis.frame.features.irradiance.irradiance import subtexel_light_constants as shader_constants

__all__ = ["shader_constants"]
