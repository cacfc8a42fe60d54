"""Pigments from skin colours: melanin and blood of colour maps, and recolouring."""
