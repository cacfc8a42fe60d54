"""What a fit found: light, skin, and how well each number is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting import sky
from dermis.apps.inverse.fitting.certainty import Certainty
from dermis.apps.inverse.fitting.subject import Subject
from dermis.apps.inverse.fitting.unknowns import SKIN, TURN_SPREAD, WHITE_SPREAD, Point

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fitted:
    """Light and skin of a photograph.

    subject : head, person, camera and pose
    point : skin and directions of suns
    strengths : (9 + k,) of the lobes of light from around and of the suns
    white : (3,) colour of the light, green 1, linear Rec. 709
    certainty : how well each number is known
    photo, picture : (h, w, 3) as large as was fitted, linear, with exposure and white balance in them
    mask : (h, w) pixels that counted
    residual : median of the absolute differences over the photograph, on these [-]
    frames, seconds : that it took
    """

    subject: Subject
    point: Point
    strengths: Floats
    white: Floats
    exposure: float
    size: tuple[int, int]
    certainty: Certainty
    photo: Floats
    picture: Floats
    mask: NDArray[np.bool_]
    residual: float
    frames: int
    seconds: float

    @property
    def values(self) -> dict[str, float]:
        """Melanin, blood, roughness and rho_s [-]."""
        return self.point.values()

    @property
    def suns(self) -> list[tuple[Floats, float]]:
        """Unit vectors towards the suns, and the irradiance of what faces them."""
        return [(way, float(s)) for way, s in zip(self.point.suns, self.strengths[sky.BASIS :], strict=True)]

    def summary(self) -> dict[str, Any]:
        """Numbers with their standard deviations, what is not determined, and what was believed.

        Deviations are relative for the skin, in degrees for directions. What the frame itself gets wrong
        everywhere alike is not in them.
        """
        return _summary(self)


def _summary(found: Fitted) -> dict[str, Any]:
    known = found.certainty
    skin = {
        one.name: {
            "value": found.values[one.name],
            "relative_sd": known.sd[one.name],
            "usual": one.usual,
            "believed_relative_sd": one.spread,
        }
        for one in SKIN
    }
    suns = []
    for k, (way, strength) in enumerate(found.suns):
        off = np.degrees([known.sd[f"sun {k + 1} {name}"] for name in ("across", "along")])
        suns.append({"towards": way.tolist(), "irradiance": strength, "sd_degrees": off.tolist()})
    coefficients = found.strengths[: sky.BASIS]
    return {
        "skin": skin,
        "suns": suns,
        "around": {"mean_radiance": float(sky.panorama(coefficients).mean())},
        "white": found.white.tolist(),
        "white_sd": [known.sd[name] for name in ("white red", "white blue") if name in known.sd],
        "exposure": found.exposure,
        "not_determined": list(known.held),
        "not_told_apart": [{"pair": [a, b], "correlation": c} for a, b, c in known.alike],
        "singular_values": list(known.singular),
        "priors": _priors(found),
        "residual": found.residual,
        "pixels": int(found.mask.sum()),
        "frames": found.frames,
        "seconds": round(found.seconds, 2),
    }


def _priors(found: Fitted) -> list[str]:
    """What was believed or given, in words."""
    told = [f"{one.name}: around {one.usual:g} within a factor of {np.exp(one.spread):.2g}" for one in SKIN]
    if found.suns:
        told.append(
            f"directions of suns: within {np.degrees(TURN_SPREAD):.0f} degrees of where the search began"
        )
    white = "white red" in found.certainty.sd
    told.append(
        f"colour of the light: neutral within {100 * WHITE_SPREAD:.0f} %"
        if white
        else f"colour of the light: given, {', '.join(f'{one:.3g}' for one in found.white)}"
    )
    told.append(f"exposure: given, {found.exposure:g}; the strength of the light is free")
    skin = found.subject.scene.skin.pigments
    assert skin is not None
    told.append(
        f"held: eumelanin {skin.eumelanin:g}, oxygen {skin.oxygen:g}, epidermis {skin.epidermis_mm:g} mm"
    )
    return told
