"""Shape of a head on the device: control points, the subdivided surface, and its curvature."""

from dermis.frame.features.shape.resources import Resources, make_resources
from dermis.frame.features.shape.shape import draw

__all__ = ["Resources", "draw", "make_resources"]
