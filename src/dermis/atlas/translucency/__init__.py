"""Division of an atlas into cells, for translucency: light through ears, nostrils, lips and eyelids."""
