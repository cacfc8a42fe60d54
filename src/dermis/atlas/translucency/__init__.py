"""Pairs of places of the surface that exchange light through thin flesh: ears, nostrils, lips, lids."""
