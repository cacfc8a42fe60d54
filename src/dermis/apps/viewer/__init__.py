"""Interactive viewer of heads in a desktop window, a web page or a notebook."""
