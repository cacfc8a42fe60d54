"""Human skin that the device paints: maps of colour, gloss and relief from pigments and noise."""
