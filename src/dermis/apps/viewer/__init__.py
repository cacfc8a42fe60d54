"""The interactive viewer: in a desktop window, a browser or a notebook."""
