"""Export to USD: a stage with a head, its rig, hairs and materials."""
