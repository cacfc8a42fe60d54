"""Unknowns of a fit, their priors, and the scene for given values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dermis.human.skin.painted import PaintedMaps
from dermis.optics.media import Floats
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene
from dermis.scene.skin import Pigments, Skin

SUN_DIAMETER_DEGREES = 0.53
"""Angle that the sun spans, for shadows."""


@dataclass(frozen=True)
class SkinUnknown:
    """Number of the skin, fitted as its logarithm.

    usual, spread : prior: median, and standard deviation of the logarithm
    low, high : limits
    step : of finite differences, in the logarithm
    """

    name: str
    usual: float
    spread: float
    low: float
    high: float
    step: float


SKIN_UNKNOWNS = (
    SkinUnknown("melanin", 0.03, 2.0, 0.0005, 0.6, 0.1),
    SkinUnknown("blood", 0.01, 0.7, 0.0005, 0.2, 0.15),
    SkinUnknown("roughness", 0.3, 0.35, 0.05, 1.0, 0.06),
    SkinUnknown("rho_s", 0.7, 0.5, 0.02, 1.0, 0.1),
)
"""Artist's beliefs, wide ones: the spread of melanin is that of all peoples, roughness that of the face's
regions; strength is between a dry skin's and a smooth boundary's. `rho_s` is what oil changes."""
_PROFILE_STEP = 0.25
"""Steps of the logarithms of pigments between which widths do not change: profiles take long."""
SUN_STEP = 0.02
"""Of finite differences of a sun's direction [rad]."""
SUN_SD = 1.0
WHITE_SD = 0.2
"""Of the logarithm of red and of blue over green, where the light's colour is looked for."""


@dataclass(frozen=True, eq=False)
class FitPoint:
    """Values of all unknowns except the strengths of lights.

    logs : (4,) logarithms of `SKIN`
    suns : (k, 3) unit vectors towards them
    white : (2,) logarithms of red and blue over green of the light
    """

    logs: Floats
    suns: Floats
    white: Floats

    def values(self) -> dict[str, float]:
        """Return the numbers of the skin by name."""
        return {one.name: float(np.exp(log)) for one, log in zip(SKIN_UNKNOWNS, self.logs, strict=True)}

    def moved(self, step: Floats) -> FitPoint:
        """Return another point within the limits.

        step : (4 + 2 k + 2,) of the logarithms, of the suns' directions along their tangents, of the white
        """
        skin, count = len(SKIN_UNKNOWNS), len(self.suns)
        low, high = np.log([one.low for one in SKIN_UNKNOWNS]), np.log([one.high for one in SKIN_UNKNOWNS])
        turns = step[skin : skin + 2 * count].reshape(count, 2)
        moved = self.suns + np.einsum("kt,ktc->kc", turns, tangents(self.suns))
        return FitPoint(
            np.clip(self.logs + step[:skin], low, high),
            moved / np.linalg.norm(moved, axis=1, keepdims=True),
            self.white + step[skin + 2 * count :],
        )


def prior_point(suns: Floats) -> FitPoint:
    """Return the means of the priors."""
    return FitPoint(np.log([one.usual for one in SKIN_UNKNOWNS]), suns, np.zeros(2))


def tangents(towards: Floats) -> Floats:
    """Return two tangents (k, 2, 3) of each direction (k, 3)."""
    helper = np.where(np.abs(towards[:, 1:2]) < 0.9, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    first = np.cross(helper, towards)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(towards, first)], axis=1)


def with_skin(scene: Scene, point: FitPoint) -> Scene:
    """Return the scene with the skin of a point.

    Painted people are painted with these pigments, and light spreads below as far as pigments near them let
    it; other heads take the colour of the pigments' profile all over, for what pigments a colour map was made
    of is not known.
    """
    found = point.values()
    changed: dict[str, object] = {name: found[name] for name in ("roughness", "rho_s")}
    changed |= {"oiliness": 0.0, "profile": "spectral"}
    if isinstance(maps := scene.head.maps, PaintedMaps):
        look = replace(maps.look, melanin=found["melanin"], blood=found["blood"])
        head = replace(scene.head, maps=replace(maps, look=look))
        melanin, blood = np.exp(_PROFILE_STEP * np.rint(point.logs[:2] / _PROFILE_STEP))
    else:
        head, melanin, blood = scene.head, found["melanin"], found["blood"]
        changed["albedo"] = "profile"
    held = (scene.skin.pigments or Pigments()).model_dump()
    own = Pigments(**(held | {"melanin": float(melanin), "blood": float(blood)}))
    return replace(scene, head=head, skin=Skin(**(scene.skin.model_dump() | changed | {"pigments": own})))


def sun_lights(towards: Floats, strengths: Sequence[float] | Floats, white: Floats) -> list[DirectionalLight]:
    """Return suns of a colour (3,) and strengths (k,), irradiance at normal incidence."""
    return [
        DirectionalLight(direction=tuple(-way), irradiance=tuple(float(s) * white), angle_degrees=SUN_DIAMETER_DEGREES)
        for way, s in zip(towards, strengths, strict=True)
    ]
