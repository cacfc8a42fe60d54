"""Skins and heads exported to other programs, rendered there, and compared with dermis."""
