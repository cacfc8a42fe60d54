"""Scattering techniques: a Python module each, with its shaders beside it."""
