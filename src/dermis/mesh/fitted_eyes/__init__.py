"""Eyeballs of realistic shape in heads from files, fitted to the file's eyeballs and lids."""
