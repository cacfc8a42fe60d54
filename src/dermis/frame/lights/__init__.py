"""Lights of the frame: a module and a shader for each kind of light, and their common records."""
