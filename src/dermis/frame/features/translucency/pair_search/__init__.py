"""The search for translucent pairs of places, on the device."""
