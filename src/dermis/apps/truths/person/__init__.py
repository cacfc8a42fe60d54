"""Reference images of people by path tracing: coated skin, refracting eyes, teeth and hair fibres."""
