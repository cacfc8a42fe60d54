"""One module or folder for each program that skin is exported to."""
