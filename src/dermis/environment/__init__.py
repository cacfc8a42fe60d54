"""Environment light: panoramas, their sun-like peaks, and prefiltering."""
