"""Diffusion models of tissue: dipole, multipole and layered diffusion, from media to profiles R(r)."""
