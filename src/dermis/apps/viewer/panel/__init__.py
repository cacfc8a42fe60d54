"""The panel: Dear ImGui controls beside the picture. Its modules need the package imgui-bundle."""
