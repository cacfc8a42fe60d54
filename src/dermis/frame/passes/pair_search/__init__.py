"""The search for translucent pairs, pass by pass."""
