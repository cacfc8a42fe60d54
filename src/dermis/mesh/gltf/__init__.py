"""glTF 2.0: geometry, morph targets, skins, animations and pictures of a file, and a head written as one."""
