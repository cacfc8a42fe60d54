"""Atlases: uv layouts as surfaces, with stitched seams, form factors and cells for translucency."""
