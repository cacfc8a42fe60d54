"""Label classes of the face: classes of triangles and hairs, and border distances of skin."""
