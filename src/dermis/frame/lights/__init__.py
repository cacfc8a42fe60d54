"""Lights of the frame: a module and a shader for each kind of light, and the records that all kinds share."""
