"""Web pages around a library of JavaScript, shared by Babylon.js and three.js."""
