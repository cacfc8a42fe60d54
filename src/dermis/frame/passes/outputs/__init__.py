"""What a frame knows besides its colour: stages, each a shader for those of its outputs that are asked."""
