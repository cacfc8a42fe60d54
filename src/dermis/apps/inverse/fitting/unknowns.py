"""Unknowns of a fit with their priors, and how they change the skin and lights of a scene.

A "sun" is a directional light of unknown direction and strength; a fit has up to two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from dermis.human.skin.painted import PaintedMaps
from dermis.optics.media import Floats
from dermis.optics.pigments.priors import skin_prior
from dermis.scene.lights import DirectionalLight
from dermis.scene.model import Scene
from dermis.scene.skin import Pigments, Skin

SUN_DIAMETER_DEGREES = 0.53
"""Angular diameter of the sun, which determines the penumbra of its shadows [degrees]."""


@dataclass(frozen=True)
class SkinUnknown:
    """Unknown parameter of the skin; a fit varies its logarithm.

    name : name of the parameter
    prior_median : median of the parameter's prior
    prior_sd : prior standard deviation of the parameter's logarithm
    low, high : smallest and largest value of the parameter
    step : step of the logarithm for finite differences
    """

    name: str
    prior_median: float
    prior_sd: float
    low: float
    high: float
    step: float


def _measured_unknown(
    pigment_name: str, lower_limit: float, upper_limit: float, log_step: float
) -> SkinUnknown:
    """Return a pigment as an unknown, with its distribution among measured people as prior.

    lower_limit, upper_limit : smallest and largest value
    log_step : step of the logarithm for finite differences
    """
    mean, sd = skin_prior().moments(pigment_name)
    return SkinUnknown(pigment_name, float(np.exp(mean)), sd, lower_limit, upper_limit, log_step)


SKIN_UNKNOWNS = (
    _measured_unknown("melanin", 0.0005, 0.6, 0.1),
    _measured_unknown("blood", 0.0005, 0.2, 0.15),
    SkinUnknown("roughness", 0.3, 0.35, 0.05, 1.0, 0.06),
    SkinUnknown("rho_s", 0.7, 0.5, 0.02, 1.0, 0.1),
)
"""Unknown parameters of the skin. The prior of each pigment is its distribution among measured people. The
other priors are wide: the prior of the roughness covers all regions of a face, and the prior of `rho_s`
covers the range from dry skin to a smooth boundary."""
_PROFILE_LOG_STEP = 0.25
"""Step to which logarithms of pigments are rounded for the diffusion profile, as profiles are slow to fit."""
SUN_STEP_RAD = 0.02
"""Step of finite differences of a sun's direction [rad]."""
SUN_PRIOR_SD = 1.0
WHITE_PRIOR_SD = 0.2
"""Prior standard deviation of the logarithms of the ratios red/green and blue/green of the light's colour."""


@dataclass(frozen=True, eq=False)
class FitUnknowns:
    """Values of all unknowns of a fit except the strengths of lights.

    logs : (4,) logarithms of the skin parameters, in the order of `SKIN_UNKNOWNS`
    suns : (k, 3) unit vectors towards the suns
    white : (2,) logarithms of the light's ratios red/green and blue/green, relative to the colour that the
        user gives
    """

    logs: Floats
    suns: Floats
    white: Floats

    def skin_values(self) -> dict[str, float]:
        """Return a dictionary from name to value of each skin parameter."""
        return {one.name: float(np.exp(log)) for one, log in zip(SKIN_UNKNOWNS, self.logs, strict=True)}

    def stepped(self, unknowns_step: Floats) -> FitUnknowns:
        """Return the unknowns after a step, with the skin parameters clipped to their limits.

        unknowns_step : (4 + 2 k + 2,) steps: first of the logarithms of the 4 skin parameters; then of each
            of the k suns' directions, along its two `tangents`; last of the 2 logarithms `white`
        """
        skin, count = len(SKIN_UNKNOWNS), len(self.suns)
        low, high = np.log([one.low for one in SKIN_UNKNOWNS]), np.log([one.high for one in SKIN_UNKNOWNS])
        sun_steps = unknowns_step[skin : skin + 2 * count].reshape(count, 2)
        stepped = self.suns + np.einsum("kt,ktc->kc", sun_steps, tangents(self.suns))
        return FitUnknowns(
            np.clip(self.logs + unknowns_step[:skin], low, high),
            stepped / np.linalg.norm(stepped, axis=1, keepdims=True),
            self.white + unknowns_step[skin + 2 * count :],
        )


def prior_unknowns(sun_directions: Floats) -> FitUnknowns:
    """Return unknowns with all skin parameters at the medians of their priors, and with given suns (k, 3)."""
    return FitUnknowns(np.log([one.prior_median for one in SKIN_UNKNOWNS]), sun_directions, np.zeros(2))


def tangents(directions: Floats) -> Floats:
    """Return two unit vectors (k, 2, 3) that are perpendicular to each direction and to each other.

    directions : (k, 3) directions, unit vectors
    """
    helper = np.where(np.abs(directions[:, 1:2]) < 0.9, (0.0, 1.0, 0.0), (1.0, 0.0, 0.0))
    first = np.cross(helper, directions)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(directions, first)], axis=1)


def with_skin(scene: Scene, fit_unknowns: FitUnknowns) -> Scene:
    """Return the scene with the skin that the unknowns of a fit describe.

    If the head's maps are painted from pigments, they are painted with the pigments of `fit_unknowns`, but
    the diffusion profile, which is slow to compute, is that of the nearest pigments of a coarse grid. Other
    heads get a uniform colour in place of their colour map; this colour and their diffusion profile are those
    of the pigments of `fit_unknowns`.
    """
    numbers = fit_unknowns.skin_values()
    skin_values: dict[str, object] = {name: numbers[name] for name in ("roughness", "rho_s")}
    skin_values |= {"oiliness": 0.0, "profile": "spectral"}
    if isinstance(maps := scene.head.maps, PaintedMaps):
        look = replace(maps.look, melanin=numbers["melanin"], blood=numbers["blood"])
        head = replace(scene.head, maps=replace(maps, look=look))
        melanin, blood = np.exp(_PROFILE_LOG_STEP * np.rint(fit_unknowns.logs[:2] / _PROFILE_LOG_STEP))
    else:
        head, melanin, blood = scene.head, numbers["melanin"], numbers["blood"]
        skin_values["albedo"] = "profile"
    fixed = (scene.skin.pigments or Pigments()).model_dump()
    pigments = Pigments(**(fixed | {"melanin": float(melanin), "blood": float(blood)}))
    skin = Skin(**(scene.skin.model_dump() | skin_values | {"pigments": pigments}))
    return replace(scene, head=head, skin=skin)


def sun_lights(
    sun_directions: Floats, irradiances: Sequence[float] | Floats, light_colour: Floats
) -> list[DirectionalLight]:
    """Return directional lights from given directions.

    sun_directions : (k, 3) unit vectors towards the suns
    irradiances : (k,) irradiance of each sun at normal incidence
    light_colour : (3,) colour of all suns; their irradiance is multiplied by it
    """
    return [
        DirectionalLight(
            direction=tuple(-sun),
            irradiance=tuple(float(s) * light_colour),
            angle_degrees=SUN_DIAMETER_DEGREES,
        )
        for sun, s in zip(sun_directions, irradiances, strict=True)
    ]
