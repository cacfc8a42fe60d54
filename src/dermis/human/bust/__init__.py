"""A head made of code alone."""

BUSTS = ("bust", "bust_many_charts")
"""The built-in heads: one with few charts, and one with as many seams as a layout can have."""
