"""Export to a web page that draws the head with three.js."""
