"""Clothing and glasses: meshes that are bound to the skin of the parametric human."""
