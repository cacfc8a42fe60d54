"""Search for translucent pairs of surface cells by shaders on the device."""
