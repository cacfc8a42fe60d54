"""Skin made of pigments: spectra of melanin and blood, and layered media that contain these pigments."""
