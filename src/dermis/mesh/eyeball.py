"""The shape of an eyeball: a ball with a cornea, in mm of a usual eye around the ball's centre."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

SCLERA_MM, CORNEA_MM, LIMBUS_MM = 12.0, 7.8, 5.85
"""Radii of the ball, of the cornea's front, and of the circle where they meet, of an adult [mm]."""
IRIS_BEHIND_MM = 3.0
"""Depth of the plane of the iris behind the cornea's apex [mm]."""


def plane_mm(radius_mm: Any) -> Any:
    """How far before the middle of a ball the cornea begins, at the limbus [mm]."""
    return np.sqrt(radius_mm**2 - LIMBUS_MM**2)


def cornea_centre_mm() -> float:
    """Where on the axis the centre of the cornea's front lies, from the ball's [mm]."""
    return float(plane_mm(SCLERA_MM) - plane_mm(CORNEA_MM))


def apex_mm() -> float:
    """Where on the axis the cornea's apex lies [mm]."""
    return cornea_centre_mm() + CORNEA_MM


def iris_mm() -> float:
    """Where on the axis the plane of the iris lies [mm]."""
    return apex_mm() - IRIS_BEHIND_MM


def profile_mm(angle: Doubles) -> Doubles:
    """Distance from the ball's centre to its surface, by the angle from its axis [rad] [mm]."""
    centre = cornea_centre_mm()
    within = np.maximum(CORNEA_MM**2 - (centre * np.sin(angle)) ** 2, 0.0)
    edge = np.arctan2(LIMBUS_MM, np.sqrt(SCLERA_MM**2 - LIMBUS_MM**2))
    return np.where(angle < edge, centre * np.cos(angle) + np.sqrt(within), SCLERA_MM)


def clearance_mm(places: Doubles, axis: Doubles) -> tuple[Doubles, Doubles]:
    """How far places (..., 3) lie from the centre and how far the surface does on the way to them [mm].

    axis : (..., 3) unit vectors along which the eye looks
    """
    far = np.linalg.norm(places, axis=-1)
    along = (places * axis).sum(axis=-1) / np.maximum(far, 1e-9)
    return far, profile_mm(np.arccos(np.clip(along, -1.0, 1.0)))
