"""Regions of the face, such as nose and cheek, each with its own roughness and specular strength."""
