"""Skin made of pigments: spectra of melanin and blood, and the resulting media."""
