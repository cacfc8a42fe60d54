"""Hair of people: brows, lashes and head hair grown from the skin as strands."""
