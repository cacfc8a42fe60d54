"""Skin made of pigments: spectra of melanin and blood, and the layered media that contain them."""
