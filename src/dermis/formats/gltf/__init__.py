"""Reading and writing of glTF 2.0 files of heads, with morph targets, bones and animations."""
