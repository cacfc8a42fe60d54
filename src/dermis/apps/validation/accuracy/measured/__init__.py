"""The spectral model of skin against measured reflectance spectra of people, for docs/measured.md."""
