"""Errors of exported skins and heads, measured in other programs."""
