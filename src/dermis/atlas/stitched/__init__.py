"""Stitched uv layouts: charts with gutters that continue the surface across the seams."""
