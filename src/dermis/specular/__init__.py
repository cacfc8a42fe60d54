"""Surface lobes, each in NumPy and WGSL, with Fresnel curves, albedo and energy."""
