"""Reference solutions that share no assumption with the renderer: Monte Carlo, path tracing, diffusion."""
