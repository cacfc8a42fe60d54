"""Export to a web page that renders the head with WebGPU and runs without a server."""
