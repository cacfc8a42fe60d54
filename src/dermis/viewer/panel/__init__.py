"""The panel over the picture, in Dear ImGui: one module for each of its sections."""
