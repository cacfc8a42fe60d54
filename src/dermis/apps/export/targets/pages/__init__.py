"""Code shared by the exports to web pages that use a JavaScript library, Babylon.js or three.js."""
