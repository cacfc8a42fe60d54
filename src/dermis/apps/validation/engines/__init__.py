"""Exported skins and heads measured in other programs, for docs/engines.md."""
