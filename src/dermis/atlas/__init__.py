"""Atlases: uv layouts in which light is diffused, with data for two further paths of light.

These are the form factors for interreflection, and the cells for translucency, which is light that passes
through ears, lips and other thin parts of a head.
"""
