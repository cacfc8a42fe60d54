"""Environment light: panoramas of radiance, extraction of suns, and prefiltering for reflections."""
