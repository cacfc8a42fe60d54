"""Viewer as a web page: HTTP canvas of rendercanvas behind a server that checks requests."""
