"""Fits of light and skin to photographs by least squares."""
