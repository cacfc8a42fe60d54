"""Atlases: uv layouts in which light is diffused, with stitched seams, form factors and thin parts."""
