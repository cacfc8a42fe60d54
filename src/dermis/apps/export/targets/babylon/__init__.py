"""Export to a web page with Babylon.js."""
