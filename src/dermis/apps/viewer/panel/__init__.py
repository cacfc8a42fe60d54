"""Control panel drawn with Dear ImGui; its modules need the package imgui-bundle."""
