"""Files of other programs, read and written: meshes, maps, motion. What they say is checked here."""
