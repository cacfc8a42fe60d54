"""Hair of people as strands: brows, lashes, hair of the head and beard."""
