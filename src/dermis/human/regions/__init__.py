"""Roughness and strength of the reflection by region of the face."""
