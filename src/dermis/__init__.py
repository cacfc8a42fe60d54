"""Human skin, physically based, in real time, checked against the truth."""
