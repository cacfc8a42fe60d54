"""Export to pbrt: a scene whose skin has the material `subsurface`."""
