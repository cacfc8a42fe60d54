"""Result of a fit: light, skin and their uncertainty, written as files of a folder."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dermis.apps.inverse.fitting.inputs import FitSubject
from dermis.apps.inverse.fitting.light_basis import BASIS, panorama
from dermis.apps.inverse.fitting.solve import Uncertainty
from dermis.apps.inverse.fitting.unknowns import (
    SUN_SD,
    SKIN_UNKNOWNS,
    WHITE_SD,
    FitPoint,
    sun_lights,
    with_skin,
)
from dermis.base.atomic_write import atomic_file
from dermis.base.errors import refuse
from dermis.human.person_file import write_person_json
from dermis.images.hdr import encode_exr
from dermis.images.io import write_image
from dermis.optics.media import Floats
from dermis.scene.environment import Environment
from dermis.scene.model import Scene
from dermis.scene.saving import save_scene
from dermis.scene.settings import Settings

SUMMARY = "fit.json"
_NO_DIFFERENCE = 0.5


@dataclass(frozen=True, eq=False)
class FitResult:
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

    subject: FitSubject
    point: FitPoint
    strengths: Floats
    white: Floats
    exposure: float
    size: tuple[int, int]
    certainty: Uncertainty
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
        return [(way, float(s)) for way, s in zip(self.point.suns, self.strengths[BASIS:], strict=True)]

    def summary(self) -> dict[str, Any]:
        """Return all numbers with their standard deviations, what is not determined, and the priors.

        Deviations are relative for the skin, in degrees for directions. Systematic errors of the renderer are
        not in them.
        """
        known = self.certainty
        skin = {
            one.name: {
                "value": self.values[one.name],
                "relative_sd": known.sd[one.name],
                "usual": one.usual,
                "believed_relative_sd": one.spread,
            }
            for one in SKIN_UNKNOWNS
        }
        suns = []
        for k, (way, strength) in enumerate(self.suns):
            off = np.degrees([known.sd[f"sun {k + 1} {name}"] for name in ("across", "along")])
            suns.append({"towards": way.tolist(), "irradiance": strength, "sd_degrees": off.tolist()})
        return {
            "skin": skin,
            "suns": suns,
            "around": {"mean_radiance": float(panorama(self.strengths[:BASIS]).mean())},
            "white": self.white.tolist(),
            "white_sd": [known.sd[name] for name in ("white red", "white blue") if name in known.sd],
            "exposure": self.exposure,
            "not_determined": list(known.held),
            "not_told_apart": [{"pair": [a, b], "correlation": c} for a, b, c in known.alike],
            "singular_values": list(known.singular),
            "priors": self._priors(),
            "residual": self.residual,
            "pixels": int(self.mask.sum()),
            "frames": self.frames,
            "seconds": round(self.seconds, 2),
        }

    def _priors(self) -> list[str]:
        """Describe priors and given numbers."""
        skin = self.subject.scene.skin.pigments
        assert skin is not None
        sun = f"directions of suns: within {np.degrees(SUN_SD):.0f} degrees of where the search began"
        white = f"neutral within {100 * WHITE_SD:.0f} %"
        if "white red" not in self.certainty.sd:
            white = f"given, {', '.join(f'{one:.3g}' for one in self.white)}"
        held = f"eumelanin {skin.eumelanin:g}, oxygen {skin.oxygen:g}, epidermis {skin.epidermis_mm:g} mm"
        spreads = {one: f"{one.usual:g} within a factor of {np.exp(one.spread):.2g}" for one in SKIN_UNKNOWNS}
        return [
            *(f"{one.name}: around {spread}" for one, spread in spreads.items()),
            *([sun] if self.suns else []),
            f"colour of the light: {white}",
            f"exposure: given, {self.exposure:g}; the strength of the light is free",
            f"held: {held}",
        ]


def save_fit(folder: Path, found: FitResult) -> list[Path]:
    """Write scene.toml with what it needs, fit.json, and pictures; each file whole or not at all.

    Raises DermisError when the disk is full, or the folder cannot be written to.
    """
    person, table = found.subject.person, found.subject.table
    if person is None and not table:
        actual = "it came as a head that only its maker knows"
        refuse("head", "a person by name, or a Human, for a file to name", actual, "Fit the Human itself")
    written = []
    radiance = panorama(found.strengths[:BASIS])
    if radiance.max() > 0.0:
        written.append(folder / "light.exr")
        with atomic_file(written[-1]) as trial:
            trial.write_bytes(encode_exr((radiance[..., None] * found.white).astype(np.float32)))
    if person is not None:
        written.append(folder / "person.json")
        look = replace(person.look, melanin=found.values["melanin"], blood=found.values["blood"])
        write_person_json(written[-1], replace(person, skin=look))
        table = {"name": "person.json"}
    written.append(folder / "scene.toml")
    settings = Settings(size=found.size, exposure=found.exposure)
    save_scene(written[-1], fitted_scene(found, folder), settings, table)
    for name, image in pictures(found).items():
        written.append(folder / f"{name}.png")
        write_image(written[-1], image)
    written.append(folder / SUMMARY)
    with atomic_file(written[-1]) as trial:
        trial.write_text(json.dumps(found.summary(), indent=2) + "\n", encoding="utf-8")
    return written


def fitted_scene(found: FitResult, folder: Path) -> Scene:
    """Return the fitted scene, whose ambient light is a file of the folder."""
    suns = sun_lights(found.point.suns, found.strengths[BASIS:], found.white)
    has_sky = panorama(found.strengths[:BASIS]).max() > 0.0
    around = Environment(name=str(folder / "light.exr")) if has_sky else None
    lights = [one for one in suns if max(one.irradiance) > 0.0]
    return with_skin(replace(found.subject.scene, lights=lights, environment=around), found.point)


def pictures(found: FitResult) -> dict[str, Floats]:
    """Return linear pictures: photograph, fit, and their difference on grey where skin counted."""
    peak = max(float(np.percentile(found.photo[found.mask], 99.5)), 1e-9)
    off = np.where(found.mask[..., None], (found.photo - found.picture) / peak, 0.0)
    shown = {"photo": found.photo / max(peak, 1.0), "fit": found.picture / max(peak, 1.0)}
    shown = {name: np.clip(image, 0.0, 1.0) for name, image in shown.items()}
    return shown | {"difference": np.clip(_NO_DIFFERENCE + off, 0.0, 1.0) ** 2.2}
