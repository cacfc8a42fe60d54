"""Division of an atlas into cells, for light that passes through ears, nostrils, lips and eyelids."""
