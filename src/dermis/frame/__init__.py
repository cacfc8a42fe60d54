"""The frame: everything that the device computes to draw a scene, and its renderer."""
