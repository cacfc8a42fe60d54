"""Features of a frame: one folder per stage, with its resources, passes, shaders and shader constants."""
