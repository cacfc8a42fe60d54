"""Measurements of accuracy and speed: comparisons with references and other renderers, and benchmarks."""
