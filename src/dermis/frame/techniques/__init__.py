"""Scattering techniques: one Python file each, with its shaders beside it."""
