"""Errors of the package's approximations against truths, for the pages of docs."""
