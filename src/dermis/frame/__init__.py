"""Frame: all that the device computes to render a scene, and the renderer."""
