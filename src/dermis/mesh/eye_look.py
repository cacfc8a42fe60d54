"""What eyes can look like, as bounds of the fields of `EyeLook`."""

LIMITS = {
    "eumelanin": (0.0, 1.0),
    "pupil_mm": (1.0, 4.0),
    "redness": (0.0, 1.0),
    "seed": (0, 2**32 - 1),
}
