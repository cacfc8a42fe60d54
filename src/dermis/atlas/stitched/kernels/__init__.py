"""The loops over texels, as machine code. Import these modules inside functions: they load numba."""
