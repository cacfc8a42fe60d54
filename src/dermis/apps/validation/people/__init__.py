"""Skin of measured people: tables of a spectral archive, and drawn people compared with it."""
