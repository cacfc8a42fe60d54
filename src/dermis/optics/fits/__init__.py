"""Fits of diffusion profiles: sums of Gaussians, Burley's curve and separable kernels."""
