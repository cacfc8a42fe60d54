"""Colour, relief and gloss of skin, from places in space: no pattern repeats, no seam shows."""
