"""Unwrapping of a mesh: charts that are flattened with little stretch and packed into one uv map."""
