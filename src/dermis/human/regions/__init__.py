"""Roughness and specular strength by region of the face."""
