"""Atlases: uv layouts in which light is diffused, with tables for interreflection and for thin parts."""
