"""Light transport in tissue: media, pigments, diffusion profiles with their fits, and transmitted light."""
