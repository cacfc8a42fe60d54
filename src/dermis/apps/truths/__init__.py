"""Reference solutions by Monte Carlo simulation, path tracing and diffusion, independent of the renderer."""
