"""Modules that all packages share: errors, registries, disk cache, file reading and number checks."""
