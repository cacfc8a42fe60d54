"""Export to glTF: a .glb whose skin scatters or transmits light by extensions."""
