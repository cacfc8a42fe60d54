"""Colour of living skin: the heartbeat, and zones of the face that states such as a blush change."""
