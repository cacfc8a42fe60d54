"""Search by shaders for pairs of surface cells on opposite sides of thin tissue."""
