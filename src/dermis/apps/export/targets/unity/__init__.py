"""Export to Unity HDRP: a DiffusionProfileSettings asset, and the maps of a head."""
