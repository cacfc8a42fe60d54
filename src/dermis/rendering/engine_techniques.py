"""What the techniques of today's engines need beside what every frame reads."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from dermis.gpu import Device
from dermis.optics.fits.separable import preintegrate
from dermis.optics.gaussians import GaussianSum
from dermis.rendering.pre_integrated import PreIntegrated, pre_integrate
from dermis.rendering.stages.screen_space import Kernel, ScreenSpace, ScreenSpread
from dermis.scene.settings import Settings

Keep = Callable[[str, Any, Callable[[], Any]], Any]
"""`Kept.keep`."""


def pre_integrated(
    keep: Keep, device: Device, settings: Settings, profile: GaussianSum
) -> PreIntegrated | None:
    """The tables of pre-integrated skin, None for other techniques."""
    if settings.technique != "pre-integrated":
        return None
    made: PreIntegrated = keep("pre-integrated", _content(profile), lambda: pre_integrate(device, profile))
    return made


def screen_spread(
    keep: Keep, stage_of: Callable[[], ScreenSpace], settings: Settings, profile: GaussianSum, view: Any
) -> ScreenSpread | None:
    """Space and kernel for light that spreads over the picture, None for other techniques.

    stage_of : the stage, asked for only when it is needed
    view : record of the shading pass
    """
    if settings.technique != "screen-space":
        return None
    stage = stage_of()

    def make() -> Kernel:
        return stage.make_kernel(preintegrate(profile))

    apart = keep("apart", settings.size, lambda: stage.make_apart(settings.size))
    half = (float(np.linalg.norm(view[axis])) for axis in ("right", "up"))
    return ScreenSpread(apart, keep("kernel", _content(profile), make), (next(half), next(half)))


def _content(profile: GaussianSum) -> bytes:
    """What makes one profile another."""
    return profile.variance_mm2.tobytes() + profile.weight.tobytes()
