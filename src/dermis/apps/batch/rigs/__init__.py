"""Rigs of data sets: several cameras that see the same person at the same time."""
