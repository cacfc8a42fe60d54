"""Measured errors of exported skins and heads in other programs."""
