"""Gallery of pictures that explain skin rendering: scripts that draw them, and a page that shows them."""
