"""Which places of the surface lie opposite each other through thin flesh: ears, nostrils, lips, lids."""
