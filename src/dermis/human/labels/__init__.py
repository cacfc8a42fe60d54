"""Parts of the face as classes: which triangles are of which, and distances by which skin is told apart."""
