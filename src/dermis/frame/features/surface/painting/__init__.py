"""Human skin painted by the device: colour, gloss and relief from pigments and noise."""
