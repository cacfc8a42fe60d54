"""Export targets: one module or folder per program."""
