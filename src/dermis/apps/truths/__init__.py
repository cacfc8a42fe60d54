"""Reference solutions that share no model with what they judge: path tracing, photons, surface integrals."""
