"""Motion from files: animation clips, facial captures and mesh sequences."""
