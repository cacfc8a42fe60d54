"""Scattering techniques: one Python module for each technique, with its shaders beside the module."""
