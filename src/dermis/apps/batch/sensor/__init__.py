"""Model of a digital camera: from linear light to the picture that the camera stores."""
