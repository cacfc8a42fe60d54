"""Features of a frame: one folder each, with its resources, passes, shaders and shader constants."""
