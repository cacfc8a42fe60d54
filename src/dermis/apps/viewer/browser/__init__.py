"""Viewer as a web page: the HTTP canvas of rendercanvas, behind a server that validates all requests."""
