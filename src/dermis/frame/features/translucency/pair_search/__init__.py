"""Search for translucent pairs by shaders on the device."""
