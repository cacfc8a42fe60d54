"""Skin of the people in a spectral archive: statistics, and comparison with people sampled at random."""
