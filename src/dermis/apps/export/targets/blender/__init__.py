"""Export to Blender: a Python script or .blend file with the head, its skin material, lights and a camera."""
