"""Eyeballs of true shape in the place of those that a file has."""
