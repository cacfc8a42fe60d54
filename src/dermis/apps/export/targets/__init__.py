"""Export targets: one module or folder for each program."""
