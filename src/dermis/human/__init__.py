"""Parametric human: shape, expressions, skin, hair, teeth, face regions and landmarks."""
