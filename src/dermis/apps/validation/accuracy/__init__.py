"""Errors of the package's approximations against exact references, for pages of the documentation."""
