"""Web pages based on a JavaScript library, shared by Babylon.js and three.js."""
