"""Skin defined by its pigments: spectra of melanin and blood, and layered media that contain both."""
