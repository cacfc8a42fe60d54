"""Specular lobes in NumPy and WGSL, with Fresnel reflectance, albedo and energy conservation."""
