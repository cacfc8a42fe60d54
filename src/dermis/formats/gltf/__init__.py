"""glTF 2.0: heads read from files with all that moves them, and written."""
