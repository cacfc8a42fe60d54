"""Export to USD: a stage with the head, its rig, hairs and materials."""
