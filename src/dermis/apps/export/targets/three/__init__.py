"""Export to a web page with three.js."""
