"""The loops over places, as machine code. Import these modules inside functions: they load numba."""
