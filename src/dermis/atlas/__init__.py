"""The uv layout as a surface: texels, charts, stitched seams, form factors and translucent pairs."""
