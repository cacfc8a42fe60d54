"""Label classes (skin, brow, lip, ...) of the triangles and hairs of a head."""
