"""Unwrapping of a mesh into charts that are flattened with little stretch and packed into one uv map."""
