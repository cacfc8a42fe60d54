"""Fits of diffusion profiles by sums of Gaussians, Burley's profile and separable kernels."""
