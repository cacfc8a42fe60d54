"""Skin of the human: pigments, marks and relief, as the parameters from which the frame paints maps."""
