"""Modules that all packages use: errors, registries, the disk cache, file reading and checks of numbers."""
