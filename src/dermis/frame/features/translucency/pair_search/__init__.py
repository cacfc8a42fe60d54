"""Search for translucent pairs on the device."""
