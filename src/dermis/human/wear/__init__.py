"""Clothing, glasses and headwear: meshes that are bound to the skin of the parametric human."""
