"""Skin of the people in a spectral archive: statistics, and comparison with randomly drawn people."""
