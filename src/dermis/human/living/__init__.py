"""Colour of living skin: the heartbeat, and zones of the face that states such as a blush change."""

TYPICAL_BEAT = "typical"
"""Name of the form of a heartbeat that is not read from a file."""
