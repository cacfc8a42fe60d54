"""Comparison of scattering techniques, and of rendered people, with reference images."""
