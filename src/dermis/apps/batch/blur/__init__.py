"""Blur of data sets by a thin lens (depth of field) and by motion during the exposure."""
