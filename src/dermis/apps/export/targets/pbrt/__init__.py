"""Export to pbrt: a scene with skin as the material `subsurface`."""
