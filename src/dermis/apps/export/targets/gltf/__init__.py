"""Export to glTF: a .glb file whose skin material scatters or transmits light by extensions."""
