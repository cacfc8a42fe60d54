"""The viewer as a web page: rendercanvas' HTTP canvas and a guarded server."""
