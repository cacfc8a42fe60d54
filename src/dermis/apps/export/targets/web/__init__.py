"""Export to a web page that renders the head with WebGPU, without a server."""
