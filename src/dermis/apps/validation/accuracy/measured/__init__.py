"""Comparison of the spectral skin model with measured reflectance spectra of people, for docs/measured.md."""
