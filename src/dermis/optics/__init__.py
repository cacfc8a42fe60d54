"""Light transport in tissue: media, pigments, diffusion profiles and their fits, and thin parts."""
