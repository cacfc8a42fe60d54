"""Comparison of dermis with other renderers, Cycles and Mitsuba, on one CPU."""
