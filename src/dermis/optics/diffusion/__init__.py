"""Diffusion models that predict the profile R(r) of a medium: dipole, multipole and layered diffusion."""
