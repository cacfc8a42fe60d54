"""Skin from pigments: spectra of melanin and blood, and the media that they give."""
