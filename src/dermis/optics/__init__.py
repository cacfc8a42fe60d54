"""Light in tissue: media, pigments, diffusion profiles and their fits, thin parts."""
