"""Skin of the human: parameters of pigments, marks and relief, from which the skin maps are painted."""
