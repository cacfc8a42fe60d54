"""Lights of the frame: a module and a shader for each kind of light, and uniform records of all lights."""
