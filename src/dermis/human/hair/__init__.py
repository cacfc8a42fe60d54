"""Hair of the parametric human as strands: brows, lashes, head hair and beard."""
