"""Export to glTF: a .glb file whose skin material has glTF extensions for scattering or transmission."""
