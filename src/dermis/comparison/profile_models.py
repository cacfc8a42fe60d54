"""How a medium's profile is known to the techniques that are judged."""

from __future__ import annotations

from typing import Literal

ModelName = Literal["layered", "montecarlo"]
"""By layered diffusion, or by photons one by one."""
