"""The parametric person: shape, expressions, skin, hair and teeth from numbers, regions and landmarks."""
