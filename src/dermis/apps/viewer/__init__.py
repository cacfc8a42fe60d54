"""Interactive viewer in a desktop window, a web page or a notebook."""
