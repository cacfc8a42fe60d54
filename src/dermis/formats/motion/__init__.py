"""Motion from files: animation clips, facial captures and sequences of meshes."""
