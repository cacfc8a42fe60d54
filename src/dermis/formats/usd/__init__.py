"""Reading of USD scenes; the package usd-core runs in a separate process with resource limits."""
