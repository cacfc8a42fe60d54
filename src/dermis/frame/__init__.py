"""Frame: all that the device computes for one picture of a scene, and the renderer that submits this work."""
