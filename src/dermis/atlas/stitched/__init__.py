"""The stitched layout of the atlas: charts apart, with gutters that show the surface across their seams."""
