"""Web pages based on a JavaScript library, with the code that Babylon.js and three.js share."""
