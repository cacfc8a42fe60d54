"""Clips of data sets: people in smooth motion, with flow between frames."""
