"""Viewer as a web page: a canvas based on rendercanvas, and a server that validates all requests."""
