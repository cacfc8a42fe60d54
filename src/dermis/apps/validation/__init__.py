"""Measurements of accuracy and speed: errors against references, other renderers, benchmarks."""
