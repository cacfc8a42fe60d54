"""The passes that paint a human's skin: whose each texel of its maps is, and what is there."""
