"""The viewer: a head to turn in one's hands, in a window, in a browser, in a notebook."""
