"""Specular lobes in NumPy and WGSL, with Fresnel reflectance, directional albedo and energy conservation."""
