"""Atlases: uv layouts in which light is diffused, with data for interreflection and translucency.

Interreflection is light that skin reflects through the air onto other skin. Translucency is light that passes
through ears, lips and other thin parts of a head.
"""
