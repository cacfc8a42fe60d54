"""Unmixing of skin colours: maps of melanin and blood from colour maps, and recolouring."""
