"""The stitched layout of the atlas: charts apart, with room beyond their edges for what lies across seams."""
