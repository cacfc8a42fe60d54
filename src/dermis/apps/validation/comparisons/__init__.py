"""Comparison of scattering techniques, and of frames of people, with reference images."""
