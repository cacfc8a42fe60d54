"""Comparison of exported skins and heads, as other programs render them, with dermis."""
