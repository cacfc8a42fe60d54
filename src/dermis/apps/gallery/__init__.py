"""Gallery of pictures that explain the technique: short scripts, and a page with all pictures."""
