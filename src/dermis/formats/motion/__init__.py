"""Motion from files: animation clips, captures of faces, sequences of meshes."""
