"""Errors of the package's approximations against references, for pages of the documentation."""
