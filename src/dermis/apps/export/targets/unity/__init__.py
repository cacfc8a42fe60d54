"""Export to the HDRP of Unity: a DiffusionProfileSettings asset, and the maps of a head."""
