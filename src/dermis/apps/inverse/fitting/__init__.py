"""Light and skin of a photograph by least squares."""
