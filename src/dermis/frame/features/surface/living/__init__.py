"""Skin whose colour and gloss change with states such as a blush, and with the pulse."""
