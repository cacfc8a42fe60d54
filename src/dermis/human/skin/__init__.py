"""The human's skin: pigments, marks and relief, as numbers that the frame paints maps from."""
