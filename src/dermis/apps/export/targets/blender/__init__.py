"""Export to Blender: a script or .blend with the material, the head, its lights and camera."""
