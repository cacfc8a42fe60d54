"""Skin of people in a spectral archive: tables for the package, and comparison with drawn people."""
