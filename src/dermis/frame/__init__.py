"""Frame: all that the device computes to render one picture of a scene, and the renderer that submits it."""
