"""Gallery of pictures that explain the technique: scripts of a few lines each, and one page of all."""
