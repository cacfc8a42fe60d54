"""Fits of diffusion profiles: sums of Gaussians, Burley's profile and separable kernels."""
