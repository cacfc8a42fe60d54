"""Numbers of the exposure meter, which its shaders fill in."""

from __future__ import annotations

SIDE = 64
"""Points along each side of the grid over the picture at which the meter looks."""
KEY = 0.85
"""What white skin shows in the light that is metered: studio light then keeps an exposure of about 1."""
CLIPPING = 0.01
"""Share of the skin in view that may be brighter than the picture can show."""
STOPPED_DOWN = 0.5
"""Least factor by which highlights lower the exposure: one stop."""


def meter_numbers() -> dict[str, float]:
    """By the shaders' names."""
    shares = {"meter_clipping": CLIPPING, "meter_stopped_down": STOPPED_DOWN}
    return {"meter_side": SIDE, "meter_key": KEY, **shares}
