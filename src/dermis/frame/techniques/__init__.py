"""Scattering techniques: one Python module for each, with its shaders beside it."""
