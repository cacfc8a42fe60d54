"""Small modules that all packages share: errors, registries, files on disk, reading limits, numbers."""
