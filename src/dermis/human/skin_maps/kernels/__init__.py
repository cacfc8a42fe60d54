"""The loops over points, as machine code. Import these modules inside functions: they load numba."""
