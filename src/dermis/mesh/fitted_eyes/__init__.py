"""Eyeballs of realistic shape for heads from files, fitted to the eyeballs and lids of the file."""
