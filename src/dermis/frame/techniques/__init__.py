"""Ways for light to spread below the skin: each a Python file, with its shaders beside it."""
