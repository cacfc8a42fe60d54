"""What the techniques of today's engines need beside what every frame reads."""

from __future__ import annotations

from collections.abc import Callable

from dermis.frame.kept import Keep
from dermis.frame.passes.screen_space import Kernel, ScreenSpace, ScreenSpread
from dermis.frame.pre_integrated import PreIntegrated, pre_integrate
from dermis.gpu import Device
from dermis.optics.fits.separable import preintegrate
from dermis.optics.gaussians import GaussianSum
from dermis.scene.settings import Settings


def pre_integrated(
    keep: Keep, device: Device, settings: Settings, profile: GaussianSum
) -> PreIntegrated | None:
    """The tables of pre-integrated skin, None for other techniques."""
    if settings.technique != "pre-integrated":
        return None
    made: PreIntegrated = keep("pre-integrated", _content(profile), lambda: pre_integrate(device, profile))
    return made


def screen_spread(
    keep: Keep, stage_of: Callable[[], ScreenSpace], settings: Settings, profile: GaussianSum
) -> ScreenSpread | None:
    """Space and kernel for light that spreads over a picture of no camera yet, None for other techniques.

    stage_of : the stage, asked for only when it is needed
    """
    if settings.technique != "screen-space":
        return None
    stage = stage_of()

    def make() -> Kernel:
        return stage.make_kernel(preintegrate(profile))

    apart = keep("apart", settings.size, lambda: stage.make_apart(settings.size))
    return ScreenSpread(apart, keep("kernel", _content(profile), make), (0.0, 0.0))


def _content(profile: GaussianSum) -> bytes:
    """What makes one profile another."""
    return profile.variance_mm2.tobytes() + profile.weight.tobytes()
