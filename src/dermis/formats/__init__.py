"""Reading and writing of other programs' files: meshes, maps and motion, with checks of their content."""
